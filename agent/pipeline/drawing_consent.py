"""Take what a language model drew into a run only where somebody accepts it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from agent.errors import NotBuildable
from grounding.figures.figure import Figure
from grounding.figures.names import figure_named
from grounding.interpretation import Interpretation

NOTE = "{} is built as the language model drew it; `structagent teach` on this run's folder keeps it"


def with_consent(
    goal: Interpretation, accepts: Callable[[Sequence[Figure]], bool]
) -> tuple[Interpretation, tuple[str, ...]]:
    """Return what is built of an instruction, and notes on drawings in it.

    Args:
        goal: of the instruction.
        accepts: returns whether drawings are to be built.

    Raises:
        NotBuildable: for drawings that are not accepted.
    """
    if goal.drawn is None:
        return goal, ()
    figures = [figure_named(shape) for shape in goal.drawings]
    nouns = " and ".join(repr(figure.nouns[0]) for figure in figures)
    if not accepts(figures):
        raise NotBuildable(
            f"no figure is called {nouns}, and the language model's drawing of it was not accepted; accept "
            "drawings with --accept-drawings, say it in `structagent chat`, or teach the figure first with "
            "`structagent teach`"
        )
    return goal.drawn, (NOTE.format(nouns),)
