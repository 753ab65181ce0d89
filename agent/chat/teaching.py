"""Read lines that give a structure a name, "call this a city gate", and words for the structure before,
"like the one before".
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.chat.state import Situation
from agent.errors import UsageError
from agent.figures.examples import example_of_clouds
from agent.rendering.text import with_indefinite_article
from grounding.dialogue.acts import bare, is_question
from grounding.figures.figure import Figure
from grounding.figures.names import figure_named, is_figure
from grounding.goals.goal import Goal
from grounding.propose.example_words import compared
from grounding.structure_words import words_of
from structdiffusion.figures.example import figure_of
from structdiffusion.models.strokes.reading import read_strokes
from structdiffusion.observation import ObjectCloud

_IT = r"(?:this|that|it|these|the structure|the figure|what (?:stands|is) here)"
_WHAT = rf"(?:{_IT}(?: structure| figure| one)?|(?P<{{}}>the example))"
_CALLED = re.compile(
    rf"(?:i |we |you can |(?:let's|let us) )?(?:(?:call|name) {_WHAT.format('called')}(?: as)?"
    rf"|(?:remember|keep|save|learn|store) {_WHAT.format('kept')} as"
    rf"|{_IT}(?:'s| is| are)(?: to be)? (?:called|named))"
    r" (?P<name>(?:an? |the )?[a-z0-9][\w -]*)"
)
_BEFORE = re.compile(
    r"\b(?:(?:an?other|an?|one)(?: one| structure| thing)? )?like the (?:one|structure|figure) "
    r"(?:before|we (?:had|built|made)|from before)\b"
    r"|\b(?:(?:an?other|an?|one)(?: one| structure| thing)? )?like the (?:last|previous|earlier) "
    r"(?:one|structure|figure)\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class TaughtName:
    """A name that a line gives to a structure.

    Attributes:
        name: as it was said.
        of_example: whether "the example" gets it, and not what is proposed or stands.
    """

    name: str
    of_example: bool


def taught_name(line: str) -> TaughtName | None:
    """Return the name that a line gives to a structure; `None` for a line that says anything else."""
    found = None if is_question(line) else _CALLED.fullmatch(bare(line))
    return None if found is None else TaughtName(found["name"], bool(found["called"] or found["kept"]))


def figure_at_hand(situation: Situation, seen: Sequence[ObjectCloud], arranged: bool, name: str) -> Figure:
    """Return the figure that is meant: what is proposed, what was built, or else what all that stands on the table
    shows.

    Args:
        situation: of the conversation.
        seen: the objects on the table.
        arranged: whether somebody arranged the table: it is no drawn one.
        name: of a figure that is read off objects.

    Raises:
        UsageError: where nothing is proposed or built on a drawn table, and where several structures may be meant.
        FigureError: for fewer than two objects.
    """
    structures = situation.goal.structures
    if len(structures) > 1:
        raise UsageError(f"there are {len(structures)} structures, and a figure is taught from one; build it alone")
    proposal = situation.proposal
    if proposal is None and not arranged and not (structures and situation.built):
        raise UsageError("no structure is proposed or built yet; say what to build, then what to call it")
    shape = structures[0].shape if structures else None
    if shape is not None and is_figure(shape):
        return figure_named(shape)  # `teach` gives it the other name
    clouds = list(seen if proposal is None else proposal.scene.objects)
    motions = np.repeat(np.eye(4)[None], len(clouds), axis=0)
    if proposal is not None:
        motions = proposal.proposed.arrangements[proposal.rank - 1].goal_from_initial
    names = {cloud.name for cloud in clouds}
    if structures and structures[0].objects is not None:
        names = {situation.names[index] for index in structures[0].objects}  # type: ignore[index]
    own = [number for number, cloud in enumerate(clouds) if cloud.name in names]
    return figure_of(example_of_clouds([clouds[number] for number in own], motions[own]), name, (name,), read_strokes)


def with_structure_before(text: str, goal: Goal, example: str = "") -> str:
    """Return a text with the name of the goal's structure in place of "like the one before".

    Args:
        text: any line.
        goal: so far, or the one that was built last.
        example: the name of the figure that "the example" is; "" for none. Without a structure before, that is meant.

    Raises:
        UsageError: if there is no such structure, or there are several.
    """
    if _BEFORE.search(text) is None or (example and not goal.structures):
        return text
    shapes = {part.shape for part in goal.structures if part.shape is not None}
    if len(shapes) != 1:
        raise UsageError(
            "there is no structure before" if not shapes else f"which one do you mean: {', '.join(sorted(shapes))}?"
        )
    shape = shapes.pop()
    said = "the example" if shape == example else with_indefinite_article(words_of(shape).words.nouns[0])
    return compared(_BEFORE.sub(said, text))
