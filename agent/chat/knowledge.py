"""Collect what an answer can use: the present table and the state of the conversation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from agent import events
from agent.chat.greeting import Suggestion, invitation
from agent.chat.state import Situation
from agent.chat.table_facts import Fact, matching_facts, object_facts
from grounding.parse_result import Question

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

DECIDE = "“y” builds it, “n” drops it, and words such as “bigger” change it"


@dataclass(frozen=True)
class Knowledge:
    """All that an answer can draw on.

    Attributes:
        seen: the table as it is now.
        situation: where the conversation stands.
        question: what the agent has asked and is not answered yet, or `None`.
        example: finds an instruction that suits the table, if there is one.
        held: the name of what is in the hand, or `None`.
        fallen: the names of the objects that fell off the table.
        encoder: finds what unknown nouns mean.
    """

    seen: events.Perceived
    situation: Situation
    question: Question | None = None
    example: Callable[[], Suggestion | None] = lambda: None
    held: str | None = None
    fallen: tuple[str, ...] = ()
    encoder: SentenceEncoder | None = None

    @cached_property
    def facts(self) -> list[Fact]:
        """What there is to say of each object."""
        return object_facts(self.seen, self.situation.viewpoint)

    def matching(self, about: str) -> list[Fact]:
        """Return the objects that some words mean; "it" and "they" are those that take part."""
        if about in ("it", "they", "them", "those", "these") and self.situation.goal is not None:
            return [fact for fact in self.facts if fact.name in self.situation.objects]
        return matching_facts(about, self.facts, self.encoder)


def next_step(known: Knowledge) -> str:
    """Return what the speaker can say next."""
    if known.question is not None:
        return f"I still need an answer: {known.question.text}"
    if known.situation.proposal is not None:
        return f"A proposal stands: {DECIDE}."
    return invitation(known.example())
