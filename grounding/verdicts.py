"""Make the interpretation of a text out of what was decided about it, or out of what a language model said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from grounding.decide import BUILD, Candidate, Decision
from grounding.figures.drawings import without_drawings
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.language_model.goal_reply import ModelReply
from grounding.language_model.goal_schema import ASK, NONE
from grounding.parse_result import Question, Slots, parse_of
from grounding.propose.proposal import Proposal
from grounding.resolve.goal import ResolvedPhrase
from grounding.resolve.object_names import read_name
from grounding.sentences import GOAL, doubts, goal_question, reason, shape_question
from grounding.spec import StructureSpec


@dataclass(frozen=True)
class Verdicts:
    """A maker of interpretations of one text.

    Attributes:
        text: as it was given.
        slots: the five slots, or what reads them.
        before: the goal so far, in the speaker's frame.
        viewpoint: whose left and right it speaks of.
        names: of the objects that are there; `None` where they are not known.
        common: further fields that all its interpretations have.
    """

    text: str
    slots: Slots
    before: Goal
    viewpoint: str
    names: Sequence[str] | None
    common: dict[str, Any] = field(default_factory=dict)

    def of_decision(self, decision: Decision, proposals: Sequence[Proposal]) -> Interpretation:
        """Return the interpretation that a decision leads to.

        Args:
            decision: about the text.
            proposals: all that there were.
        """
        self = replace(self, common={"probability": decision.probability})
        if decision.status == "ok":
            assert decision.chosen is not None and decision.chosen.proposal.goal is not None
            asked = shape_question(decision.chosen.proposal.goal, self.names)
            return self._built(decision.chosen) if asked is None else self._asked(*asked)
        if decision.status == "ask":
            doubtful = decision.chosen.proposal.choices if decision.chosen is not None and not decision.offered else ()
            return self._asked(goal_question(self.text, decision, self.names), decision.offered or doubtful)
        same = [one for one in proposals if one.goal == self.before and one.certainty >= BUILD]
        if self.before.parts and same:
            return self.refused(
                "; ".join((*same[0].notes, "that is already so; say what should change")), unchanged=True
            )
        wish = next((each.goal for each in proposals if each.problem and each.goal is not None), Goal())
        nothing = sum(each.certainty for each in proposals if each.answer == "nothing") > 0.5
        return self.refused(
            reason(self.text, decision, proposals, self.names),
            suggestions=tuple(map(self._in_world, decision.offered)), wish=self._in_world(wish), nothing=nothing,
        )  # fmt: skip

    def of_choice(self, chosen: Candidate) -> Interpretation:
        """Return the interpretation of a goal that is to be built wherever it can be had."""
        proposal = chosen.proposal
        if proposal.question is not None:
            return self._asked(proposal.question, proposal.choices)
        if proposal.problem or proposal.goal is None:
            return self.refused(proposal.problem, wish=self._in_world(proposal.goal or Goal()))
        return self._built(chosen)

    def of_reply(self, reply: ModelReply, proposal: Proposal | None) -> Interpretation:
        """Return the interpretation that a language model's reply leads to: its goal is built wherever it can be had.

        Args:
            reply: of the model.
            proposal: its goal with the objects found; `None` where it has none.
        """
        slots = self.slots
        self = replace(self, slots=cache(lambda: replace(
            parse_of(slots), parser="llm", confidence={}, evidence={}, dropped={}, status="ok", message="",
            question=None,
        )))  # fmt: skip
        if proposal is not None:
            found = self.of_choice(Candidate(proposal))
            return replace(found, by_model=True, probability=1.0) if found.status == "ok" else found
        if reply.decision == ASK:
            goals = [one for one in reply.options if isinstance(one, Goal)]
            options = [describe_parts(one.parts, self.names) if isinstance(one, Goal) else one for one in reply.options]
            question = Question(GOAL, reply.question, tuple(options))
            return self._asked(question, goals if len(goals) == len(options) else ())
        nothing = reply.decision == NONE
        message = (
            reply.reason or f"the language model finds {'nothing to build' if nothing else 'that it cannot be built'}"
        )
        return self.refused(message, nothing=nothing)

    def of_drawings(self, found: Interpretation, shapes: Sequence[str]) -> Interpretation:
        """Return the interpretation that asks whether to build what a language model drew.

        Args:
            found: with a goal that has the drawings.
            shapes: of the drawings.
        """
        goal = self._in_world(found.goal)  # back to the speaker's
        said = describe_parts(goal.parts, self.names)
        nouns = " and ".join(repr(without_drawings(one)) for one in shapes)
        text = f"there is no figure {nouns}, so the language model has drawn one; build this: {said}?"
        asked = self._asked(Question(GOAL, text, (said,)), (goal,))
        return replace(
            asked, fallback=found.fallback, seconds=found.seconds, by_model=True, drawn=found, drawings=tuple(shapes)
        )

    def refused(self, message: str, **more: Any) -> Interpretation:
        """Return the interpretation that builds nothing, and says why."""
        return self._made(status="refused", message=message, **more)

    def _asked(self, question: Question, choices: Sequence[Goal]) -> Interpretation:
        """Return the interpretation that asks, with the goals behind the options."""
        goals = tuple(map(self._in_world, choices))
        return self._made(status="ask", message=question.text, question=question, choices=goals, suggestions=goals)

    def _built(self, chosen: Candidate) -> Interpretation:
        """Return the interpretation whose goal is built."""
        proposal, names = chosen.proposal, self.names
        assert proposal.goal is not None
        lost = tuple(word for word in chosen.lost if not any(repr(word) in note for note in proposal.notes))
        goal, notes = self._in_world(proposal.goal), (*proposal.notes, *doubts(lost))
        spec = goal.structures[0].spec if goal.structures else StructureSpec()
        built: dict[str, Any] = {"status": "ok", "message": "; ".join(notes), "goal": goal, "spec": spec}
        if names is None:
            words = tuple(map(str, goal.named_objects()))
            return self._made(**built, objects=words or None, words=words, named=words)
        named = tuple(one for one in goal.named_objects() if isinstance(one, int))
        everything = any(part.objects is None for part in goal.structures)
        indices = tuple(range(len(names))) if everything else tuple(sorted(named))
        selection = ResolvedPhrase(indices, proposal.nouns, proposal.described, notes, proposal.singly)
        objects = tuple(names[i] for i in indices)
        said = proposal.nouns if everything or len(indices) == len(names) else (_said(proposal) or objects)
        return self._made(**built, objects=objects, selection=selection, named=said, words=proposal.nouns)

    def _made(self, **values: Any) -> Interpretation:
        fields: dict[str, Any] = {
            "slots": self.slots,
            "viewpoint": self.viewpoint,
            "seconds": 0.0,
            "spec": StructureSpec(),
            "objects": None,
        }
        return Interpretation(**(fields | self.common | values))

    def _in_world(self, goal: Goal) -> Goal:
        return goal.turned() if self.viewpoint == "opposite" else goal


def _said(proposal: Proposal) -> tuple[str, ...]:
    """Return the nouns that chose the objects of a goal, and words for those that none chose: "object 5"."""
    worded = proposal.worded
    own = () if worded is None else worded.phrases[: len(worded.phrases) - len(worded.kept)]
    bare = (each for each in own if not proposal.nouns or (read_name(each).number and not read_name(each).head))
    return (*proposal.nouns, *dict.fromkeys(bare))
