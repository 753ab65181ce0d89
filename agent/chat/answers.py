"""What the agent answers to small talk and questions, from what the table and the conversation really hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.chat.greeting import Suggestion, invitation
from agent.chat.situation import Build, Situation
from agent.chat.table_facts import Fact, coordinates, facts_of, inventory, listed, meant_by, place_in_words, the, unjudged
from agent.telling import aligned, number, shortcoming
from grounding.dialogue_act_wordings import SUPERLATIVES
from grounding.dialogue_acts import Act
from grounding.nouns import plural, singular
from grounding.parse import Question
from grounding.spec import SHAPES, StructureSpec

if TYPE_CHECKING:
    from grounding.encoder import SentenceEncoder

_OTHERS_SHOWN = 3  # candidates that an explanation compares
_STRUCTURES = frozenset("circle ring line row tower stack pile setting structure arrangement proposal candidate".split())
_DECIDE = "“y” builds it, “n” drops it, and words such as “bigger” change it"


@dataclass(frozen=True)
class Knowledge:
    """All that an answer can draw on.

    Attributes:
        seen: the table as it is now.
        situation: where the conversation stands.
        question: what the agent has asked and nobody has answered, or `None`.
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
        return facts_of(self.seen, self.situation.viewpoint)

    def meant(self, about: str) -> list[Fact]:
        """The objects that some words mean; "it" and "they" are those that take part."""
        if about in ("it", "they", "them", "those", "these") and self.situation.wish is not None:
            return [fact for fact in self.facts if fact.name in self.situation.objects]
        return meant_by(about, self.facts, self.encoder)


def answer(acts: Sequence[Act], known: Knowledge) -> str:
    """The answer to all of a line's acts, in lines of plain text."""
    return "\n".join(_ANSWERS[act.kind](act, known) for act in acts)


def unanswerable(known: Knowledge) -> str:
    """What is said to a question that is none of those that can be answered."""
    return (
        "I cannot answer that. I can say what is on the table (“what do you see”, “where is "
        f"{the(known.facts[0].name) if known.facts else 'the cup'}”), what I propose (“why that one”) and what I did "
        f"(“what did you just do”). {_invitation(known)}"
    )


# --- small talk ------------------------------------------------------------------------------


def _invitation(known: Knowledge) -> str:
    if known.question is not None:
        return f"I still need an answer: {known.question.text}"
    if known.situation.proposal is not None:
        return f"A proposal stands: {_DECIDE}."
    return invitation(known.example())


def _greeting(act: Act, known: Knowledge) -> str:
    return f"Hello. {_invitation(known)}"


def _thanks(act: Act, known: Knowledge) -> str:
    return f"You are welcome. {_invitation(known)}" if known.situation.proposal or known.question else "You are welcome."


def _identity(act: Act, known: Knowledge) -> str:
    return (
        "I am structagent, a program that arranges objects on a table with a simulated Kinova Jaco arm. "
        f"{_invitation(known)}"
    )


def _abilities(act: Act, known: Knowledge) -> str:
    return (
        f"I arrange the objects on the table into one structure: a {', a '.join(SHAPES[:-1])} or a {SHAPES[-1]}, of a size, "
        "at a place and facing a way that you can name. Afterwards “bigger”, “now a line” or “the other side” change it, "
        "and “undo” takes it back. You can ask what is on the table, where something is, and why I chose an arrangement. "
        f"/help lists the commands. {_invitation(known)}"
    )


def _working(act: Act, known: Knowledge) -> str:
    return (
        "I read your sentence into a shape, a size, a position and a rotation, look at the table through a depth camera, "
        "imagine 64 arrangements of the objects that you named, and rank them by how well they fit and how safely they "
        f"stand. You decide, then the arm builds the best one and I check what stands. {_invitation(known)}"
    )


# --- the table -------------------------------------------------------------------------------


def _not_there(about: str, known: Knowledge) -> str:
    gone = [name for name in known.fallen if singular(about.split()[-1]) in name]
    if gone:
        return f"{_capital(listed([the(name) for name in gone]))} fell off the table."
    if not known.facts:
        return "Nothing stands on the table."
    words = about.split()
    one = words[-1] == singular(words[-1]) and not words[-1].isdecimal()
    phrase = f"There is no {about}" if one or words[-1].isdecimal() else f"There are no {about}"
    return f"{phrase} on the table. {_there(known)}"


def _there(known: Knowledge) -> str:
    nouns = [fact.noun for fact in known.facts]
    return f"There {'is' if nouns.count(nouns[0]) == 1 else 'are'}: {inventory(known.facts)}."


def _caveat(about: str, known: Knowledge) -> str:
    words = unjudged(about, known.facts)
    return f"I cannot tell what is {listed([f'“{word}”' for word in words])}. " if words else ""


def _objects(act: Act, known: Knowledge) -> str:
    lines = []
    if known.facts:
        count = len(known.facts)
        lines.append("One object stands on the table:" if count == 1 else f"{count} objects stand on the table:")
        lines += [f"  {line}" for line in aligned([(one.name, one.color, one.where) for one in known.facts]).splitlines()]
    else:
        lines.append("Nothing stands on the table.")
    if known.held is not None:
        lines.append(f"{_capital(the(known.held))} is in the hand.")
    if known.fallen:
        lines.append(f"Fallen off the table: {listed(known.fallen)}.")
    return "\n".join(lines)


def _where(act: Act, known: Knowledge) -> str:
    if act.about.split()[-1] in _STRUCTURES:
        return _next(act, known) if known.situation.proposal is not None else _done(act, known)
    found = known.meant(act.about)
    if not found:
        return _not_there(act.about, known)
    return "\n".join((_caveat(act.about, known) + _capital(f"{the(one.name)} is {_in_hand(one, known)}.")) for one in found)


def _in_hand(one: Fact, known: Knowledge) -> str:
    return "in the hand" if one.name == known.held else one.where


def _is_there(act: Act, known: Knowledge) -> str:
    found = known.meant(act.about)
    if not found:
        return f"No. {_not_there(act.about, known)}"
    return f"{_caveat(act.about, known)}Yes: {'; '.join(f'{the(one.name)} is {_in_hand(one, known)}' for one in found)}."


def _count(act: Act, known: Knowledge) -> str:
    if not act.about and known.situation.wish is not None:
        found = known.meant("they")
    else:
        found = known.meant(act.about)
    if not found:
        return _not_there(act.about, known)
    names = listed([f"{one.name} ({one.color})" if one.color else one.name for one in found])
    nouns = {one.noun for one in found}
    noun = nouns.pop() if len(nouns) == 1 else "object"
    counted = f"is 1 {noun}" if len(found) == 1 else f"are {len(found)} {plural(noun)}"
    return f"{_caveat(act.about, known)}There {counted}: {names}."


def _color(act: Act, known: Knowledge) -> str:
    found = known.meant(act.about)
    if not found:
        return _not_there(act.about, known)
    offered = [word for word in act.value.split() if word != "or"]
    told = [f"{the(one.name)} is {one.color}" if one.color else f"the color of {the(one.name)} was not seen" for one in found]
    said = _capital("; ".join(told)) + "."
    if not offered or not all(one.color for one in found):
        return said
    return f"Yes. {said}" if all(one.color in offered for one in found) else f"No. {said}"


def _size(act: Act, known: Knowledge) -> str:
    found = known.meant(act.about)
    if not found:
        return _next(act, known) if act.about.split()[-1] in _STRUCTURES else _not_there(act.about, known)
    return "\n".join(_capital(f"{the(one.name)} is about {_sides(one)}.") for one in found)


def _object(act: Act, known: Knowledge) -> str:
    found = known.meant(act.about)
    if not found:
        return _not_there(act.about, known)
    return "\n".join(_capital(f"{one.called}: about {_sides(one)}, {_in_hand(one, known)}.") for one in found)


def _sides(one: Fact) -> str:
    long, short, height = (round(100 * side) for side in one.sides)
    return f"{height} cm tall and {long} by {short} cm across"


_MEASURES: Mapping[str, tuple[Callable[[Fact], float], Callable[[Fact], str]]] = {
    "height": (lambda one: one.sides[2], lambda one: f"{100 * one.sides[2]:.0f} cm tall"),
    "width": (lambda one: one.sides[0], lambda one: f"{100 * one.sides[0]:.0f} cm long"),
    "volume": (lambda one: float(np.prod(one.sides)), lambda one: f"about {_sides(one)}"),
    "distance": (
        lambda one: float(np.hypot(*one.position[:2])),
        lambda one: f"{100 * np.hypot(*one.position[:2]):.0f} cm from the arm",
    ),
    "left": (lambda one: one.position[1], lambda one: one.place),
}


def _extreme(act: Act, known: Knowledge) -> str:
    found = known.meant(act.about)
    if not found:
        return _not_there(act.about, known)
    measure, most = SUPERLATIVES[act.value]
    value, told = _MEASURES[measure]
    if measure == "left" and known.situation.viewpoint == "opposite":
        most = not most
    first, *others = sorted(found, key=value, reverse=most)
    second = f" Next is {the(others[0].name)}, {told(others[0])}." if others else ""
    return f"{_caveat(act.about, known)}The {act.value} is {the(first.name)}, {told(first)}.{second}"


# --- what is proposed, and what was done -----------------------------------------------------


def wish_in_words(spec: StructureSpec, objects: Sequence[str]) -> str:
    """A wish: "a small circle of cup 1, cup 2 and cup 3 (left)"."""
    values = [value for slot, value in spec.tokens() if slot not in ("shape", "size")]
    shape = " ".join(filter(None, (spec.size, spec.shape or "structure")))
    return f"a {shape} of {listed(objects)}" + (f" ({', '.join(values)})" if values else "")


def _why(act: Act, known: Knowledge) -> str:
    proposal = known.situation.proposal
    if proposal is None:
        return f"Nothing is proposed now, so there is no choice to explain. {_invitation(known)}"
    candidates = proposal.imagined.candidates
    rank = int(act.value or proposal.rank)
    if not 1 <= rank <= len(candidates):
        return f"There is no candidate {rank}; there are 1 to {len(candidates)}."
    mine, best = candidates[rank - 1], candidates[0]
    factors = listed([f"{name} {number(value, 2)}" for name, value in mine.scores.items() if name != "total"])
    place = "the best" if rank == 1 else f"number {rank}"
    lines = [
        f"Candidate {rank} is {place} of {len(candidates)}: its score, {number(mine.scores.get('total'), 2)}, is the product of "
        f"{factors}."
    ]
    others = [one for one in candidates[: _OTHERS_SHOWN + 1] if one is not mine and one is not best][:_OTHERS_SHOWN]
    if mine is not best:
        lines.append(f"Against the best, candidate 1: {shortcoming(mine.scores, best.scores)}.")
    lines += [f"Candidate {one.rank}: {shortcoming(one.scores, best.scores)}." for one in others]
    return "\n".join((*lines, "/why shows all factors, /choose takes another one."))


def _next(act: Act, known: Knowledge) -> str:
    situation = known.situation
    if known.question is not None or situation.proposal is None:
        return _invitation(known) if known.question is not None else f"Nothing is planned. {_invitation(known)}"
    lines = [f"I propose candidate {situation.proposal.rank}, {wish_in_words(situation.wish, situation.objects)}:"]  # type: ignore[arg-type]
    about = {fact.name for fact in known.meant(act.about)} if act.kind == "next" and act.about else set()
    for goal in situation.proposal.chosen.goals:
        if not about or goal["name"] in about:
            place = place_in_words(goal["position"], known.seen.table, situation.viewpoint)
            lines.append(f"  {the(goal['name'])} goes {place}: {coordinates(goal['position'])}")
    return "\n".join((*lines, f"Nothing moves until you agree: {_DECIDE}."))


def _done(act: Act, known: Knowledge) -> str:
    builds = known.situation.builds
    if not builds:
        return f"Nothing that I built stands on the table. {_invitation(known)}"
    return told_of(builds[-1])


def told_of(build: Build) -> str:
    """What became of a build, in a sentence or two."""
    what = wish_in_words(build.wish, build.objects)
    moved = f"I moved {listed([the(name) for name in build.moved])}" if build.moved else "Nothing was moved"
    if build.trouble:
        return f"I tried to build {what}. {moved}. It is not as asked: {build.trouble}."
    return f"I built {what}, and it stands as asked. {moved}." if build.moved else f"I tried {what} without the arm: it would stand."


def _wish(act: Act, known: Knowledge) -> str:
    situation = known.situation
    if situation.wish is None:
        return f"You have asked for nothing so far. {_invitation(known)}"
    said = f"You asked for {wish_in_words(situation.wish, situation.objects)}."
    if known.question is not None or situation.proposal is not None:
        return f"{said} {_invitation(known)}"
    return f"{said} {told_of(situation.builds[-1])}" if situation.builds else said


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


_ANSWERS: Mapping[str, Callable[[Act, Knowledge], str]] = {
    "greeting": _greeting, "thanks": _thanks, "identity": _identity, "abilities": _abilities, "working": _working,
    "objects": _objects, "where": _where, "there": _is_there, "count": _count, "color": _color, "size": _size,
    "object": _object, "extreme": _extreme, "why": _why, "next": _next, "done": _done, "wish": _wish,
}  # fmt: skip
