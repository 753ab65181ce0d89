"""Let the goal network propose goals in the words of a text, for an instruction or for what is said about a goal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cached_property

from grounding.figures.figure import FigureError
from grounding.goal_network.beam_search import Request, WrittenGoal
from grounding.goal_network.goal_rendition import AfterGoal, Rendition, rendition_of
from grounding.goal_network.parts import UnreadLengthError, parts_of
from grounding.goal_network.writer import NetworkWriter
from grounding.goals.goal import Goal
from grounding.propose.example_words import compared, like_mentions
from grounding.propose.figure_mentions import (
    OPENING,
    Mention,
    mentions_of,
    shapes_named,
)
from grounding.propose.proposal import WordedGoal
from grounding.propose.qualifiers import qualified
from grounding.propose.stand_ins import StandIns
from grounding.resolve.attributes import SceneObject
from grounding.structure_words import words_of

READINGS = 3  # of a text with a shape that was not taught, each with another stand-in; their certainties are averaged
_UNLIKE = "it does not refer to the example; say 'the same', for example 'the same with the cups on the left'"
LIKELIEST = 5  # proposals of a text: where the first is wrong, one of the others is right for half of the texts


class NetworkProposer:
    """A proposer with the goal network, which is loaded at its first use.

    Args:
        make: makes the network.
        like: the name of the figure that texts speak of as "the same" or "one like this"; "" for none.
        always: whether every text is about it. In a conversation only those are that say so.
    """

    def __init__(self, make: Callable[[], NetworkWriter], like: str = "", always: bool = True) -> None:
        self._make, self._like, self._always = make, like, always

    @cached_property
    def network(self) -> NetworkWriter:
        """Return the network."""
        return self._make()

    def propose(
        self, text: str, objects: Sequence[SceneObject] | None = None, before: Goal = Goal(), answers: bool = True
    ) -> tuple[WordedGoal, ...]:
        """Propose the likeliest goals of a text, the most certain first; none for a text that is too long.

        Args:
            text: any string.
            objects: of the scene; `None` where it is not known.
            before: the goal so far; without parts for an instruction.
            answers: whether an answer may be proposed in place of a goal.

        Raises:
            GoalNetworkError: for weights that cannot be used.
        """
        if self._like:
            said = compared(text)
            meant = like_mentions(said, self._like, self._always, bool(before.parts))
            if meant or self._always:
                if not meant:
                    return (WordedGoal(1.0, problem=_UNLIKE),)
                return _qualified(self._averaged(said, meant, objects, before, answers), said, objects, meant)
        figures = mentions_of(text, objects, {part.shape for part in before.structures if part.shape is not None})
        plain = self._averaged(text, (), objects, before, answers)
        if not figures or (
            sum(one.certainty for one in plain if one.parts) > 0.5 and _is_said(plain[0], text, figures)
        ):
            # also "a castle? No, a tower", "you are a star, put the cups in a ring"
            return _qualified(plain, text, objects)
        try:
            _ = [words_of(one.name) for one in figures]
        except FigureError as error:
            return (WordedGoal(1.0, problem=str(error), before=before),)
        read = self._averaged(text, figures, objects, before, answers)
        return _qualified(read, text, objects, figures) if read else _qualified(plain, text, objects)

    def _averaged(
        self, text: str, figures: Sequence[Mention], objects: Sequence[SceneObject] | None, before: Goal, answers: bool
    ) -> tuple[WordedGoal, ...]:
        """Propose goals of a text that names some figures: with several stand-ins, where it needs any."""
        stand_ins = _stand_ins(text, figures, before)
        readings = [self._proposed(one, objects, before, answers) for one in stand_ins]
        if len(readings) == 1:
            return readings[0]
        # A noun that becomes an object, or is lost, was no figure.
        kept = [one for one in readings if one and _has_figures(one[0], figures)]
        if 2 * len(kept) <= READINGS:
            return ()
        found = [replace(each, certainty=each.certainty / len(kept)) for one in kept for each in one]
        return tuple(sorted(found, key=lambda each: -each.certainty))

    def ahead(self, asked: Iterable[tuple[str, Sequence[SceneObject] | None, Goal]]) -> None:
        """Let the network write at once what `propose` will ask of it for many texts, which takes less time.

        Args:
            asked: texts, each with the objects of its scene and the goal so far.
        """
        if self._like:
            return
        requests = [
            Request.of(_with_goal(stand_ins, objects, before)[0], objects)
            for text, objects, before in asked
            for stand_ins in _stand_ins(text, (), before)
        ]
        self.network.ahead(requests, LIKELIEST)

    def _proposed(
        self, stand_ins: StandIns, objects: Sequence[SceneObject] | None, before: Goal, answers: bool
    ) -> tuple[WordedGoal, ...]:
        """Propose goals with some stand-ins."""
        text, rendition = _with_goal(stand_ins, objects, before)
        written: Sequence[WrittenGoal] = self.network.likeliest(text, LIKELIEST, objects, answers)
        if rendition is not None:
            written = [AfterGoal(one.words, one.actions, one.certainty, rendition) for one in written]
        return tuple(_worded(one, stand_ins.text, stand_ins, before) for one in written)


def _stand_ins(text: str, figures: Sequence[Mention], before: Goal) -> list[StandIns]:
    """Return the stand-ins with which a text is read: several where it, or the goal so far, needs any."""
    first = StandIns.of(text, figures, before)
    others = range(1, READINGS if first.shapes else 1)
    return [first, *(StandIns.of(text, figures, before, number) for number in others)]


def _with_goal(
    stand_ins: StandIns, objects: Sequence[SceneObject] | None, before: Goal
) -> tuple[str, Rendition | None]:
    """Return what the network reads: a text after the goal so far in words, and these; `None` for an instruction."""
    so_far = stand_ins.goal(before)
    if not so_far.parts:
        return stand_ins.text, None
    rendition = rendition_of(so_far, objects or ())
    return f"{rendition.text} {stand_ins.text}", rendition


def _qualified(
    proposed: Sequence[WordedGoal], text: str, objects: Sequence[SceneObject] | None, figures: Sequence[Mention] = ()
) -> tuple[WordedGoal, ...]:
    """Return goals with what their text says of figures besides their names."""
    found = qualified(text, objects, figures)
    return tuple(replace(one, qualified=found) for one in proposed) if found else tuple(proposed)


def _has_figures(one: WordedGoal, figures: Sequence[Mention]) -> bool:
    """Return whether a goal has the figures that its text names, those of the goal so far aside:
    they may be what it drops.
    """
    shapes = {part.get("shape") for part in (*one.parts, *one.before.to_dict()["parts"])}
    lost = one.stand_ins.are_objects(one.phrases) or any(figure.name not in shapes for figure in figures)
    return not one.parts or not lost


def _is_said(one: WordedGoal, text: str, figures: Sequence[Mention]) -> bool:
    """Return whether a goal that was read of a text is told by other words than the names of figures: its shapes are
    named, or it opens somewhere, as no figure does. "A double line" names no line.
    """
    shapes = {part["shape"] for part in one.parts if part["kind"] == "structure"}
    for figure in figures:
        text = text[: figure.first] + " " * (figure.end - figure.first) + text[figure.end :]
    return OPENING.search(text) is not None or shapes <= shapes_named(text)


def _worded(written: WrittenGoal, text: str, stand_ins: StandIns, before: Goal) -> WordedGoal:
    """Return a goal that the network wrote in words."""
    follows = isinstance(written, AfterGoal)
    try:
        found = parts_of(written, " ".join(written.words) if follows else text)
    except UnreadLengthError as error:
        return WordedGoal(written.certainty, problem=f"the instruction {error}", stand_ins=stand_ins)
    known, about = ({}, "") if not isinstance(written, AfterGoal) else (written.rendition.known, written.rendition.text)
    parts = stand_ins.parts(found.parts)
    return WordedGoal(
        written.certainty, parts, found.kept, found.answer, known=known, before=before, about=about, stand_ins=stand_ins
    )
