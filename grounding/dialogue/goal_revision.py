"""Define a sentence that is said about a goal, and its effect on the goal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from grounding.dialogue.goal_changes import listed
from grounding.dialogue.goal_mentions import GoalText
from grounding.dialogue.revise import REVISION_STATUSES, Revision
from grounding.dialogue.scene_reader import GoalReader, SpokenReading
from grounding.goals.goal import Goal
from grounding.parse_result import OBJECT, Question
from grounding.spec import StructureSpec

PART = "part"  # what a question about which part is meant asks for, in place of a slot
_CORNER = re.compile(r"\b(?:the|a|one|any|some) corner\b", re.IGNORECASE)
_QUOTED = re.compile(r"'(?P<phrase>[^']+)' can be each of")


@dataclass(frozen=True)
class GoalRevision:
    """The effect of a sentence on the last goal in a conversation.

    Attributes:
        goal: what is wanted now: the last goal where nothing changes or all is refused, or where there is a question.
        status: "ok", "ask" (`question` says what), "refused" or "unchanged" (`message` says why).
        kind: "edit" for a correction, "add" where parts were added, "new" for an instruction of its own.
        message: what has to be said: why not, the question, which part was meant; may be empty.
        changed: the numbers of the parts of `goal` that are new or other than before.
        dropped: the numbers of the parts of the last goal that are gone.
        question: only with "ask"; its slot is `PART`, `OBJECT` or a slot of a structure.
        choices: for each option of the question the goal that it leads to, or the text to say in place of the sentence.
        plain: the revision of one structure, where that says it all; the goal is then the last one.
        read: how the sentence was read as a whole instruction, or the parts that it adds; `None` where it was not.
    """

    goal: Goal
    status: str
    kind: str = "edit"
    message: str = ""
    changed: tuple[int, ...] = ()
    dropped: tuple[int, ...] = ()
    question: Question | None = None
    choices: tuple[Goal | str, ...] = field(default=())
    plain: Revision | None = None
    read: SpokenReading | None = None

    def __post_init__(self) -> None:
        if self.status not in REVISION_STATUSES:
            raise ValueError(f"status cannot be {self.status!r}; legal values: {', '.join(REVISION_STATUSES)}")


@dataclass(frozen=True)
class Turn:
    """A sentence that may change a goal.

    Attributes:
        last: the goal, as spoken.
        text: the sentence.
        said: the parts of the goal and the objects that the sentence names.
        reader: reads whole instructions.
        stands: for each part what the arrangement that was shown realises of it; may be shorter than the parts.
        built: whether the goal stands on the table.
        open: whether the goal is still to be built: what is said of other objects then adds to it.
    """

    last: Goal
    text: str
    said: GoalText
    reader: GoalReader
    stands: Sequence[StructureSpec | None]
    built: bool
    open: bool = True

    def after(self, goal: Goal, text: str) -> Turn:
        """Return the turn in which another sentence is said about another goal."""
        return replace(
            self, last=goal, text=text, said=GoalText(text, goal, self.said.objects, self.said.encoder)
        )


def new_goal(last: Goal, read: SpokenReading, text: str = "") -> GoalRevision:
    """Return the revision that an instruction of its own is."""
    if read.status == "ok" and read.goal.parts:
        return GoalRevision(read.goal, "ok", "new", read.message, tuple(range(len(read.goal.parts))), read=read)
    if read.status == "ask" and read.question is not None:
        return GoalRevision(
            last,
            "ask",
            "new",
            read.question.text,
            question=read.question,
            choices=_texts(read.question, text),
            read=read,
        )
    return GoalRevision(last, "refused", "new", read.message, read=read)


def _texts(question: Question, text: str) -> tuple[str, ...]:
    """Return what to say in place of the sentence for each answer to a question about an object; else nothing."""
    if "front left" in question.options:
        return tuple(_CORNER.sub(f"the {option} corner", text, count=1) for option in question.options)
    found = _QUOTED.search(question.text)
    if question.slot != OBJECT or found is None or found["phrase"].lower() not in text.lower():
        return ()
    pattern = re.compile(rf"(?:\b(?:an?|the|one) )?{re.escape(found['phrase'])}", re.IGNORECASE)
    return tuple(pattern.sub(lambda _, name=option: f"the {name}", text, count=1) for option in question.options)


def anew(turn: Turn, read: SpokenReading, text: str = "") -> GoalRevision:
    """Return an instruction that takes the place of the whole goal, and say so.

    Args:
        turn: the sentence and the goal.
        read: how the instruction was read.
        text: of the instruction; by default the whole sentence.
    """
    new = new_goal(turn.last, read, text or turn.text)
    if turn.built or new.status != "ok" or not turn.last.parts:
        return new
    note = f"this takes the place of {listed(turn.last, turn.said.names)}; “also …” adds to it"
    return replace(new, message="; ".join(filter(None, (new.message, note))))
