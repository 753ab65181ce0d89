"""Answer small talk and questions from the table and the state of the conversation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from agent.chat.explanations import (
    describe_builds,
    describe_last_build,
    describe_plan,
    describe_remaining,
    explain_choice,
    requested,
)
from agent.chat.knowledge import Knowledge, next_step
from agent.chat.relation_answers import MEASURES, RELATION_ANSWERS, measure_of, sides_in_words
from agent.chat.table_facts import Fact, capitalized, join_words, unknown_adjectives, with_article
from agent.rendering.text import aligned, with_indefinite_article
from grounding.dialogue.acts import Act
from grounding.figures.names import figure_nouns
from grounding.resolve.word_forms import plural, singular
from grounding.spec import SHAPES

_STRUCTURES = frozenset(
    "circle ring line row tower stack pile setting structure arrangement proposal candidate".split()
)


def answer(acts: Sequence[Act], known: Knowledge) -> str:
    """Answer all of a line's acts, in lines of plain text."""
    return "\n".join(_ANSWERS[act.kind](act, known) for act in acts)


def reply_to_unknown_question(known: Knowledge) -> str:
    """Reply to a question of a kind that the chat cannot answer."""
    return (
        "I cannot answer that. I can say what is on the table (“what do you see”, “where is "
        f"{with_article(known.facts[0].name) if known.facts else 'the cup'}”), what I propose (“why that one”) and "
        "what I did "
        f"(“what did you just do”). {next_step(known)}"
    )


# --- small talk ------------------------------------------------------------------------------


def _greeting(act: Act, known: Knowledge) -> str:
    return f"Hello. {next_step(known)}"


def _thanks(act: Act, known: Knowledge) -> str:
    return f"You are welcome. {next_step(known)}" if known.situation.proposal or known.question else "You are welcome."


def _identity(act: Act, known: Knowledge) -> str:
    return (
        "I am structagent, a program that arranges objects on a table with a simulated Kinova Jaco arm. "
        f"{next_step(known)}"
    )


def _abilities(act: Act, known: Knowledge) -> str:
    return (
        f"I arrange objects on the table into {_with_articles(SHAPES)} or a figure such as a heart. You can name the "
        "size, the place, the direction, gaps, a radius, rows or an order. I also put single objects left of, right "
        "of, in front of, behind, next to, between, on or in others, in a corner or some centimetres from where they "
        "are, and I exchange objects. One sentence may ask for several of these parts. Afterwards “bigger”, “drop part "
        "2”, “put the bowl on the other side” or “5 cm more” changes a part, “also …” adds one, and “undo” takes the "
        "change back. You can ask what is on the table, where something is, what is left to do, and why I chose an "
        "arrangement. /help lists the commands. "
        f"{next_step(known)}"
    )


def _working(act: Act, known: Knowledge) -> str:
    return (
        "I divide your sentence into parts: structures, and relations between objects. I look at the table through a "
        "depth camera, propose arrangements that satisfy all parts, and rank them by how well they fit and how safely "
        "they stand. You decide, then the arm builds the best one, and I check the result. "
        f"{next_step(known)}"
    )


# --- the table -------------------------------------------------------------------------------


def _not_there(act: Act, known: Knowledge) -> str:
    """Say that no such object is on the table, or that none stands in the place asked about."""
    if act.relation and known.matching(act.about):
        return f"No {act.about} {_SHORT.get(act.relation, act.relation)} the {act.other} was seen."
    return known.not_there(act.about)


_SHORT = {"left of": "to the left of", "right of": "to the right of", "nearest": "near"}


def _caveat(about: str, known: Knowledge) -> str:
    words = unknown_adjectives(about, known.facts)
    return f"I cannot tell what is {join_words([f'“{word}”' for word in words])}. " if words else ""


def _objects(act: Act, known: Knowledge) -> str:
    lines = []
    if known.facts:
        count = len(known.facts)
        lines.append("One object stands on the table:" if count == 1 else f"{count} objects stand on the table:")
        rows = aligned([(one.label, one.color, one.where) for one in known.facts])
        lines += [f"  {row}" for row in rows.splitlines()]
    else:
        lines.append("Nothing stands on the table.")
    if known.held is not None:
        lines.append(f"{capitalized(with_article(known.held))} is in the hand.")
    if known.fallen:
        lines.append(f"Fallen off the table: {join_words(known.fallen)}.")
    return "\n".join(lines)


def _where(act: Act, known: Knowledge) -> str:
    if act.about.split()[-1] in _STRUCTURES:
        return describe_plan(act, known) if known.situation.proposal is not None else describe_last_build(act, known)
    found = known.meant(act)
    if not found:
        return _not_there(act, known)
    sentences = "\n".join(capitalized(f"{with_article(one.name)} is {_in_hand(one, known)}.") for one in found)
    return _caveat(act.about, known) + sentences


def _shape_asked_for(words: str) -> str:
    """Return the shape or the figure that the words name, in the singular; empty if they name none."""
    shape = " ".join(singular(word) for word in words.split())
    return (
        shape
        if shape in SHAPES
        else next((name for name, nouns in figure_nouns().items() if shape in (name, *nouns)), "")
    )


def _with_articles(shapes: Sequence[str]) -> str:
    said = list(map(with_indefinite_article, shapes))
    return " or ".join(filter(None, (", ".join(said[:-1]), said[-1])))


def _in_hand(one: Fact, known: Knowledge) -> str:
    return "in the hand" if one.name == known.held else one.where


def _is_there(act: Act, known: Knowledge) -> str:
    shape = _shape_asked_for(act.about)
    if shape and shape not in {one.noun for one in known.facts}:
        return f"Yes: I can build {_with_articles((shape,))}."
    found = known.meant(act)
    if not found:
        return f"No. {_not_there(act, known)}"
    places = "; ".join(f"{with_article(one.name)} is {_in_hand(one, known)}" for one in found)
    return f"{_caveat(act.about, known)}Yes: {places}."


def _count(act: Act, known: Knowledge) -> str:
    if not act.about and known.situation.asked:
        found = known.matching("they")
    else:
        found = known.meant(act)
    if not found:
        return _not_there(act, known)
    names = join_words([f"{one.name} ({one.color})" if one.color else one.name for one in found])
    nouns = {one.noun for one in found}
    noun = nouns.pop() if len(nouns) == 1 else "object"
    counted = f"is 1 {noun}" if len(found) == 1 else f"are {len(found)} {plural(noun)}"
    return f"{_caveat(act.about, known)}There {counted}: {names}."


def _color(act: Act, known: Knowledge) -> str:
    found = known.meant(act)
    if not found:
        return _not_there(act, known)
    offered = [word for word in act.value.split() if word != "or"]
    colors = [
        f"{with_article(one.name)} is {one.color}"
        if one.color
        else f"the color of {with_article(one.name)} was not seen"
        for one in found
    ]
    said = capitalized("; ".join(colors)) + "."
    if not offered or not all(one.color for one in found):
        return said
    return f"Yes. {said}" if all(one.color in offered for one in found) else f"No. {said}"


def _size(act: Act, known: Knowledge) -> str:
    found = known.meant(act)
    if not found:
        return describe_plan(act, known) if act.about.split()[-1] in _STRUCTURES else _not_there(act, known)
    return "\n".join(capitalized(f"{with_article(one.name)} is about {sides_in_words(one)}.") for one in found)


def _object(act: Act, known: Knowledge) -> str:
    found = known.matching(act.about)
    if not found:
        return _not_there(act, known)
    lines = [f"{one.described}: about {sides_in_words(one)}, {_in_hand(one, known)}." for one in found]
    return "\n".join(map(capitalized, lines))


def _extreme(act: Act, known: Knowledge) -> str:
    found = known.meant(act)
    if not found:
        return _not_there(act, known)
    measure, most = measure_of(act.value)
    value, in_words = MEASURES[measure]
    if measure == "left" and known.situation.viewpoint == "opposite":
        most = not most
    first, *others = sorted(found, key=value, reverse=most)
    second = f" Next is {with_article(others[0].name)}, {in_words(others[0])}." if others else ""
    return f"{_caveat(act.about, known)}The {act.value} is {with_article(first.name)}, {in_words(first)}.{second}"


_ANSWERS: Mapping[str, Callable[[Act, Knowledge], str]] = {
    "greeting": _greeting, "thanks": _thanks, "identity": _identity, "abilities": _abilities, "working": _working,
    "objects": _objects, "where": _where, "there": _is_there, "count": _count, "color": _color, "size": _size,
    "object": _object, "extreme": _extreme, "why": explain_choice, "next": describe_plan, "done": describe_last_build,
    "wish": requested, "built": describe_builds, "remaining": describe_remaining, **RELATION_ANSWERS,
}  # fmt: skip
