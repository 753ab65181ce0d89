"""Answer questions about several objects: their relations, comparisons and distances."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from agent.chat.knowledge import Knowledge
from agent.chat.relation_facts import clear_gap, direction_from, region_of
from agent.chat.table_facts import Fact, capitalized, join_words, with_article
from grounding.dialogue.act_words import COMPARATIVES, SUPERLATIVES
from grounding.dialogue.acts import Act

_TIE = 0.005  # m, or share of a volume: what differs by less is the same to the camera
Answer = Callable[[Act, Knowledge], str]


def named(facts: Sequence[Fact]) -> str:
    """Join the names of objects, as in "the banana, cup 1 and cup 2"."""
    return join_words([with_article(one.name) for one in facts])


def sides_in_words(one: Fact) -> str:
    """Format the size of an object, as in "9 cm tall and 8 by 8 cm across"."""
    long, short, height = (round(100 * side) for side in one.sides)
    return f"{height} cm tall and {long} by {short} cm across"


# Measure -> how to take it from an object, and how to say it.
MEASURES: Mapping[str, tuple[Callable[[Fact], float], Callable[[Fact], str]]] = {
    "height": (lambda one: one.sides[2], lambda one: f"{100 * one.sides[2]:.0f} cm tall"),
    "width": (lambda one: one.sides[0], lambda one: f"{100 * one.sides[0]:.0f} cm long"),
    "volume": (lambda one: float(np.prod(one.sides)), lambda one: f"about {sides_in_words(one)}"),
    "distance": (
        lambda one: float(np.hypot(*one.position[:2])),
        lambda one: f"{100 * np.hypot(*one.position[:2]):.0f} cm from the arm",
    ),
    "left": (lambda one: one.position[1], lambda one: one.place),
}


def measure_of(word: str) -> tuple[str, bool]:
    """Return the measure that a superlative, a comparative or "as tall as" compares,
    and whether it asks for the most.
    """
    if word.startswith("as "):
        return {"tall": "height", "high": "height", "wide": "width", "long": "width"}.get(
            word.split()[1], "volume"
        ), True
    return SUPERLATIVES[COMPARATIVES.get(word, word)]


def none_there(about: str, known: Knowledge) -> str:
    """Say that nothing on the table matches the words; empty if something does."""
    return "" if known.references(about) or region_of(about) else known.not_there(about)


def answer_related(act: Act, known: Knowledge) -> str:
    """Answer which objects are in a relation to another one, or in a region of the table."""
    relation = act.relation or ("nearest" if act.value in ("nearest", "closest", "next") else "on")
    if absent := none_there(act.other, known):
        return absent
    if act.value == "on":  # "what is the cup standing on"
        return _supports(known.references(act.other), known.supposed)
    these = known.matching(act.about) if act.about else known.facts
    found = known.standing(these, relation, act.other)
    where = f"{_SAID.get(relation, relation)} {_place(act.other, known)}"
    if found and relation == "nearest":
        return f"Nearest to {_place(act.other, known)} is {_with_gap(found[0], known.references(act.other))}."
    if found:
        references = [] if region_of(act.other) or relation in ("on", "in", "under") else known.references(act.other)
        if references:
            found = sorted(found, key=lambda one: _gap(one, references))
        these_found = [_with_gap(one, references) for one in found]
        return f"{capitalized(where)}: {join_words(these_found)}."
    what = f"No {act.about}" if act.about else "Nothing"
    near = known.standing(known.facts, "nearest", act.other) if relation == "next to" else []
    hint = f" The nearest is {_with_gap(near[0], known.references(act.other))}." if near else ""
    return f"{what} stands {where}.{hint}"


_SAID = {"left of": "to the left of", "right of": "to the right of", "nearest": "near"}


def _place(words: str, known: Knowledge) -> str:
    references = known.references(words)
    if references and not region_of(words):
        return named(references)
    return f"the {words.removeprefix('the ')}"


def _with_gap(one: Fact, references: Sequence[Fact]) -> str:
    if not any(each.name != one.name for each in references):
        return with_article(one.name)
    return f"{with_article(one.name)}, {100 * _gap(one, references):.0f} cm away"


def _gap(one: Fact, references: Sequence[Fact]) -> float:
    return min((clear_gap(one, each) for each in references if each.name != one.name), default=0.0)


def _supports(these: Sequence[Fact], supposed: Collection[str]) -> str:
    said = [
        f"{with_article(one.name)} {'seems to stand' if one.name in supposed else 'stands'} on "
        f"{with_article(one.on) if one.on else 'the table'}"
        for one in these
    ]
    return f"{capitalized(join_words(said))}."


def answer_holds(act: Act, known: Knowledge) -> str:
    """Answer whether objects stand as the question says, and if not, where they stand."""
    these = known.matching(act.about)
    if not these:
        return known.not_there(act.about)
    if absent := none_there(act.other, known):
        return absent
    found = known.standing(these, act.relation, act.other)
    if len(found) == len(these):
        return f"Yes: {_where_they_are(found, act, known)}."
    others = [one for one in these if one not in found]
    return f"No: {_where_they_are(others, act, known)}."


def _where_they_are(these: Sequence[Fact], act: Act, known: Knowledge) -> str:
    references = [] if region_of(act.other) else known.references(act.other)
    said = []
    for one in these:
        others = [each for each in references if each.name != one.name]
        near = min(others, key=lambda each: clear_gap(one, each), default=None)
        if near is None or one.on or near.on == one.name:
            said.append(f"{with_article(one.name)} is {one.where}")
        else:
            side = direction_from(near, one, known.situation.viewpoint)
            gap = 100 * clear_gap(one, near)
            said.append(
                f"{with_article(one.name)} is {_SAID.get(side, side)} {with_article(near.name)}, {gap:.0f} cm away"
            )
    return "; ".join(said)


def answer_empty(act: Act, known: Knowledge) -> str:
    """Answer whether something stands on an object."""
    these = known.references(act.other)
    if not these:
        return known.not_there(act.other)
    on = [one for one in known.facts if one.on in {each.name for each in these}]
    yes = (not on) == (act.value in ("empty", "free", "clear"))
    what = f"{named(on)} {'is' if len(on) == 1 else 'are'}" if on else "nothing is"
    return f"{'Yes' if yes else 'No'}: {what} on {named(these)}."


def answer_distance(act: Act, known: Knowledge) -> str:
    """Answer how far apart two objects are."""
    ones, others = known.references(act.about), known.references(act.other)
    for found, words in ((ones, act.about), (others, act.other)):
        if not found:
            return known.not_there(words)
    pairs = [(one, other) for one in ones for other in others if one.name != other.name]
    lines = []
    for one, other in pairs:
        centres = 100 * float(np.hypot(*np.subtract(one.position[:2], other.position[:2])))
        between = f"{with_article(one.name)} and {with_article(other.name)}"
        gap = 100 * clear_gap(one, other)
        lines.append(f"Between {between} there are {gap:.0f} cm; their centers are {centres:.0f} cm apart.")
    return "\n".join(lines) or "That is the same object."


def answer_compare(act: Act, known: Knowledge) -> str:
    """Answer which of two objects, or groups, is taller, wider or larger."""
    ones, others = known.references(act.about), known.references(act.other)
    for found, words in ((ones, act.about), (others, act.other)):
        if not found:
            return known.not_there(words)
    measure, most = measure_of(act.value)
    value, in_words = MEASURES[measure]
    said = "; ".join(f"{with_article(one.name)} is {in_words(one)}" for one in (*ones, *others))
    if act.value.startswith("as "):
        same = all(_tied(value(one), value(other), measure) for one in ones for other in others)
        return f"{'Yes' if same else 'No'}: {said}."
    sign = 1 if most else -1
    more = all(sign * value(one) > sign * value(other) and not _tied(value(one), value(other), measure)
               for one in ones for other in others)  # fmt: skip
    if act.relation == "or":
        less = all(sign * value(one) < sign * value(other) and not _tied(value(one), value(other), measure)
                   for one in ones for other in others)  # fmt: skip
        which = named(ones) if more else named(others) if less else "Neither"
        return f"{capitalized(which)}: {said}."
    return f"{'Yes' if more else 'No'}: {said}."


def _tied(one: float, other: float, measure: str) -> bool:
    allowed = 0.05 * max(one, other) if measure == "volume" else _TIE
    return abs(one - other) <= allowed


def answer_same(act: Act, known: Knowledge) -> str:
    """Answer whether objects have the same size, height or colour."""
    these = known.references(act.about)
    if not these:
        return known.not_there(act.about)
    if len(these) == 1:
        return f"There is only one: {named(these)}."
    if "color" in act.value:
        if not all(one.color for one in these):
            return f"The colors of {named(these)} were not all seen."
        same = len({one.color for one in these}) == 1
        said = "; ".join(f"{with_article(one.name)} is {one.color}" for one in these)
    else:
        measure = "height" if "height" in act.value or "tall" in act.value or "high" in act.value else (
            "width" if "width" in act.value else "volume")  # fmt: skip
        value, in_words = MEASURES[measure]
        low, high = min(map(value, these)), max(map(value, these))
        same = _tied(low, high, measure)
        said = "; ".join(f"{with_article(one.name)} is {in_words(one)}" for one in these)
    yes = same != ("different" in act.value)
    return f"{'Yes' if yes else 'No'}: {said}."


def answer_reach(act: Act, known: Knowledge) -> str:
    """Answer whether the arm can reach an object, as far as is known before planning."""
    these = known.meant(act)
    if not these:
        return known.not_there(act.about)
    said = []
    for one in these:
        if one.name == known.held:
            said.append(f"{capitalized(with_article(one.name))} is in the hand.")
        elif one.name in known.out_of_reach:
            said.append(f"No: the arm cannot take {with_article(one.name)}.")
        else:
            far = MEASURES["distance"][1](one)
            said.append(
                f"The arm may be able to take {with_article(one.name)}: it stands {far}, and nothing rules it out."
            )
    return "\n".join((*said, "Only planning a proposal (/plan) shows whether there is a motion."))


RELATION_ANSWERS: Mapping[str, Answer] = {
    "related": answer_related, "holds": answer_holds, "empty": answer_empty, "distance": answer_distance,
    "compare": answer_compare, "same": answer_same, "reach": answer_reach,
}  # fmt: skip
