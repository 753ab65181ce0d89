"""Hold the interpretation of a text: the goal, or the question or the reason why there is none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from grounding.goals.goal import Goal
from grounding.parse_result import Parse, Question, Slots, parse_of
from grounding.resolve.attributes import SceneObject
from grounding.resolve.goal import ResolvedPhrase
from grounding.spec import StructureSpec

Objects = Sequence[SceneObject | str | None]


@dataclass(frozen=True)
class Interpretation:
    """The interpretation of an instruction, or of what is said about a goal.

    Attributes:
        slots: the five slots, in the speaker's frame, or what reads them; see `parse`.
        spec: the slots in the world's frame; for a goal of several parts those of its first structure, if any.
        status: "ok", "ask" or "refused"; an instruction that names missing objects is refused.
        message: the reason of a refusal, the question, or a remark.
        viewpoint: whose left and right it speaks of, one of `VIEWPOINTS`.
        objects: names of the selected objects, or the text's words for them if no objects are known; `None` for all.
        seconds: how long it took.
        fallback: why another reader than the configured one was used, and which, or empty.
        question: what has to be known before building, with status "ask".
        choices: the goals behind the options of the question, in the world's frame; empty where an option is no goal.
        suggestions: goals that may be meant where nothing is built, the likeliest first, in the world's frame.
        selection: the selected objects; `None` if no objects are known or nothing is built.
        words: the text's own words for the objects; empty for everything.
        named: the nouns that chose the objects, or else the words; empty where everything is selected.
        goal: what should hold in the end, in the world's frame; without parts where it is refused or asked about. Its
            objects are indices into those that are there, or the text's words where none are known.
        wish: the goal that was understood but cannot be had, in the world's frame; a next sentence may mend it.
        by_model: whether a language model wrote the goal.
        probability: that the goal is what was meant; 0 where there is none.
        drawn: what is built if a person accepts what a language model drew, with status "ask"; else `None`.
        drawings: the shapes of what it drew.
        unchanged: whether the text asks for nothing but the goal so far.
        nothing: whether the text asks for nothing: a remark, or a question about the scene.
    """

    slots: Slots
    spec: StructureSpec
    status: str
    message: str
    viewpoint: str
    objects: tuple[str, ...] | None
    seconds: float
    fallback: str = ""
    question: Question | None = None
    choices: tuple[Goal, ...] = ()
    suggestions: tuple[Goal, ...] = ()
    selection: ResolvedPhrase | None = None
    words: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    goal: Goal = Goal()
    wish: Goal = Goal()
    by_model: bool = False
    probability: float = 0.0
    nothing: bool = False
    unchanged: bool = False
    drawn: Interpretation | None = None
    drawings: tuple[str, ...] = ()
    _among: Callable[[Objects, bool], Interpretation] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def parse(self) -> Parse:
        """Return the five slots, in the speaker's frame; for their confidences and the words that they are based on."""
        return parse_of(self.slots)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return a sentence for each remark about what was understood."""
        return self.selection.notes if self.selection else ()

    def among(self, objects: Objects, catalogue: bool = False) -> Interpretation:
        """Find the objects of a scene that the goal is about: where it was decided on without a scene, or if the scene
        were another.

        The text is not read again, and another goal is not chosen; without a goal, the interpretation stays as it is.

        Args:
            objects: what is there.
            catalogue: whether it is a library that a scene can be drawn from.
        """
        return self if self._among is None else self._among(objects, catalogue)

    def to_dict(self) -> dict[str, Any]:
        """Return the row of `structagent parse --json`."""
        parse, question = self.parse, self.question
        return {
            "text": parse.text,
            "goal": self.goal.to_dict(),
            "spec": self.spec.to_dict() | {"objects": None if self.objects is None else list(self.objects)},
            "status": self.status,
            "message": self.message,
            "suggestions": [goal.to_dict() for goal in self.suggestions],
            "question": {"slot": question.slot, "options": list(question.options)} if question else None,
            "confidence": {slot: round(share, 4) for slot, share in parse.confidence.items()},
            "evidence": {slot: " ".join(words) for slot, words in parse.evidence.items()},
            "dropped": dict(parse.dropped),
            "parser": parse.parser,
            "prompt_sha256": parse.prompt_sha256,
            "fallback": self.fallback,
            "viewpoint": self.viewpoint,
            "seconds": round(self.seconds, 4),
        }
