"""Collect the facts for answers: the present table and the state of the conversation."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from agent import events
from agent.chat.greeting import Suggestion, invitation
from agent.chat.relation_facts import clear_gap, in_region, region_of, related
from agent.chat.state import Situation
from agent.chat.table_facts import (
    Fact,
    capitalized,
    count_by_noun,
    join_words,
    matching_facts,
    object_facts,
    with_article,
)
from grounding.dialogue.acts import Act
from grounding.parse_result import Question
from grounding.resolve.word_forms import singular

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

DECIDE = "“y” builds it, “n” drops it, and words such as “bigger” change it"


@dataclass(frozen=True)
class Knowledge:
    """All facts that an answer can use.

    Attributes:
        seen: the observation of the present table.
        situation: the state of the conversation.
        question: the agent's unanswered question, or `None`.
        example: returns an instruction that suits the table, or `None`.
        held: the name of the object in the hand, or `None`.
        fallen: the names of the objects that fell off the table.
        encoder: sentence encoder for unknown nouns.
        out_of_reach: the names of the objects that the arm cannot reach.
        progress: what the arm is doing, in sentences; empty while it is at rest.
        supposed: the names of the objects of which the camera does not see what they stand on.
    """

    seen: events.Perceived
    situation: Situation
    question: Question | None = None
    example: Callable[[], Suggestion | None] = lambda: None
    held: str | None = None
    fallen: tuple[str, ...] = ()
    encoder: SentenceEncoder | None = None
    out_of_reach: tuple[str, ...] = ()
    progress: str = ""
    supposed: frozenset[str] = frozenset()

    @cached_property
    def facts(self) -> list[Fact]:
        """Return the facts of each object."""
        return object_facts(self.seen, self.situation.viewpoint)

    def matching(self, about: str) -> list[Fact]:
        """Return the objects that the words mean; "it" and "they" mean the participants."""
        if about in ("it", "they", "them", "those", "these") and self.situation.asked:
            return [fact for fact in self.facts if fact.name in self.situation.objects]
        return matching_facts(about, self.facts, self.encoder)

    def not_there(self, about: str) -> str:
        """Say that nothing on the table matches the words, and what is there."""
        gone = [name for name in self.fallen if singular(about.split()[-1]) in name]
        if gone:
            return f"{capitalized(join_words([with_article(name) for name in gone]))} fell off the table."
        if not self.facts:
            return "Nothing stands on the table."
        words = about.split()
        one = words[-1] == singular(words[-1]) and not words[-1].isdecimal()
        phrase = f"There is no {about}" if one or words[-1].isdecimal() else f"There are no {about}"
        nouns = [fact.noun for fact in self.facts]
        there = f"There {'is' if nouns.count(nouns[0]) == 1 else 'are'}: {count_by_noun(self.facts)}."
        return f"{phrase} on the table. {there}"

    def meant(self, act: Act) -> list[Fact]:
        """Return the objects that an act asks about, such as "cups on the plate" or "things on the left"."""
        found = self.matching(act.about)
        return self.standing(found, act.relation, act.other) if act.relation else found

    def standing(self, these: Sequence[Fact], relation: str, other: str) -> list[Fact]:
        """Return those objects that are in a relation to others, or in a region of the table.

        Args:
            these: the facts of the objects to choose from.
            relation: one of the values of `RELATIONS_SAID`.
            other: the words for the reference objects.
        """
        if (region := region_of(other)) and relation in ("on", "in"):
            return [one for one in these if in_region(one, region)]
        references = self.references(other)
        if relation == "nearest":
            others = [one for one in these if one not in references]
            return sorted(others, key=lambda one: min((clear_gap(one, each) for each in references), default=0.0))[:1]
        viewpoint = self.situation.viewpoint
        return [one for one in these if one not in references and related(one, relation, references, viewpoint)]

    def references(self, words: str) -> list[Fact]:
        """Return the reference objects that the words mean; "the mug and the bowl" means both."""
        phrases = (re.sub(r"^(?:the|a|an) ", "", each) for each in words.split(" and "))
        return list({one.name: one for each in phrases for one in self.matching(each)}.values())


def next_step(known: Knowledge) -> str:
    """Return a sentence about what the speaker can say next."""
    if known.question is not None:
        return f"I still need an answer: {known.question.sentence}"
    if known.progress:
        return "Say what should be different, “wait”, or “stop”."
    if known.situation.proposal is not None:
        return f"A proposal stands: {DECIDE}."
    return invitation(known.example())
