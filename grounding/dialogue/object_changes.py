"""Find which objects a correction adds or removes: "add the mug", "without the cups", "the bowl instead of the mug".

Rules over the noun phrases of each clause. What a clause says of objects is one of: only these ("use the cups"),
these too ("and the mug"), these not ("drop the bowl"), or these for those ("replace the mug with the bowl").
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from grounding.dialogue.replacements import PLACING, goes_and_comes, impossible
from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.mentions import read_mentions
from grounding.references.phrases import ANY, Mention, Vocabulary
from grounding.references.word_forms import FORMS
from grounding.structure_words import words_of_all

EVERYTHING = "everything"
_VERBS = (
    rf"(?:{'|'.join(words_of_all('clause_verbs'))}"
    r"|add|include|insert|remove|drop|lose|ditch|delete|exclude|omit|skip|take|leave|get|kick|throw|use|make|put"
    r"|move|turn|rotate|shift|slide|swap|replace|exchange|substitute|switch|trade|change|with|without|only"
    r"|just|keep|have|bring|set|spin|flip|forget|build|sort|paint|order|colou?r|mix|push|pull|spread"
    r"|let|do|give|arrange|point|face|lay|balance|place|form)"
)
_CLAUSE = re.compile(
    rf"[.;!?\n]+|,? *\b(?:and|but|then|or)\b(?= (?:then |also |please |now |just )*{_VERBS}\b)"
    rf"|,(?= *(?:then |also |please |now |just )*{_VERBS}\b)"
)
_POLITE = (
    r"(?:(?:please|now|ok|okay|so|then|just|actually|no|yes|well|hm+|sorry|wait|and|but|let's|can you|could you)"
    r" ?,? ?)*"
)
_THINGS = r"(?:objects|things|items|pieces|ones|stuff)"
_ALL = (
    rf"(?:everything|everyone|everybody|every (?:single )?(?:thing|object|item|one|piece)|all(?: of)? (?:the "
    rf")?{_THINGS}"
    r"|all(?: of)? (?:them|these|those|it)|all|the (?:whole|entire) lot|the lot|the whole table)"
    r"(?: (?:on the table|on the desk|there is|that is there|you (?:see|have|can see|find)|here|there))?"
)
_REST = (
    rf"(?:(?:all )?(?:of )?the (?:rest|remainder|others)(?: of (?:them|it|the {_THINGS}))?"
    rf"|(?:all )?(?:of )?the (?:other|remaining|leftover) {_THINGS}|all (?:other|remaining|others)(?: "
    rf"{_THINGS})?|everything else|everyone else"
    rf"|(?:all )?(?:of )?the (?:{_THINGS}|rest) (?:that (?:is|are) )?left(?: over)?)"
)
_TOO = r"(?:too|also|as well|in(?: (?:it|there))?|to it|with it|with them|along)"
_USING = (
    r"(?:use|using|take|with|include|add|of|from|make it|have|i want|i need|we need|i'd like|give me|build it with)"
)
_WHOLE_CLAUSE = re.compile(
    rf"{_POLITE}(?:(?:do )?(?:the )?(?:same|again)(?: thing)? ?)?(?:{_USING} )?{_ALL}(?: {_TOO})*"
    r"(?: (?:instead|please|now|this time|then|again|after all))*"
)
_WHOLE_WITHIN = re.compile(
    rf"\b(?:with|of|use|using|include|take) (?:everything|all(?: of)? (?:the )?{_THINGS}|all of (?:them"
    rf"|these|those))\b"
)
_REST_WITHIN = re.compile(rf"\b{_REST}(?= |,|$)")
_ADDING = re.compile(
    r"\b(?:add|include|insert|too|also|as well|plus|along with|together with|another|(?:one|two|three|four"
    r"|\d) more)\b"
    r"|^and\b"
    r"|\b(?:put|bring|throw|take) in\b|\b(?:put|bring|throw|get|have|want) .+ in(?: it| there)?(?=,|$)"
)
_REMOVING = re.compile(
    r"\b(?:remove|drop|lose|ditch|delete|exclude|omit|skip|kick out|throw out|get rid of|stop using|leave "
    r"(?:out|off|aside)"
    r"|take (?:away|out|off)|(?:take|leave|kick|throw|keep|put|get|set) .+ (?:out|away|off|aside|back)(?: "
    r"of (?:it|there|this))?)(?=,| |$)"
    r"|\b(?:out|can go|has to go|have to go|must go|should go|away)$"
    r"|\b(?:don't|do not|no longer) (?:want|need|like|use|include)\b"
)
_NO = re.compile(
    r"(?:no|not|without|minus|never mind|forget(?: about)?)(?: (?:the|a|an|any|that|this|those|these|my"
    r"|more|of|with))*"
)
# What follows a noun without being one: "use the can instead".
_ADVERBS = re.compile(
    r"\b(?:instead|rather|(?:anti|counter)?clockwise|altogether|completely|entirely|besides)\b"
    r"|(?<=\bput )in\b|(?<=\bbring )in\b|(?<=\bthrow )in\b|(?<=\btake )in\b"
)
_BEFORE_A_CAN = re.compile(
    r"(?:^|,|\b(?:the|a|an|this|that|my|your|our|his|her|each|every|another|one|and|or|no|with|without|not"
    r"|add|use)) $"
)
_COUNTED = re.compile(r"(?:\d|(?:one|a|an|any|every|each|the|another)\b)")
_ARTICLE = re.compile(r"(?:\b(?:the|a|an|my|your|our|that|those|these|this|any|another) )+$")
_COMING_AND_GOING = frozenset(
    "add include insert too also as well plus along with together put bring throw take get have want let "
    "in it there "
    "remove drop lose ditch delete exclude omit skip kick out rid of leave off aside away keep set back "
    "without minus "
    "not no don't do like need use except but and or please now just can you could i i'd would has to go "
    "must should "
    "then so ok okay again still actually sorry them from this".split()
)
_KEPT = re.compile(r"keep (?!.*\b(?:out|away|where|aside|only|just|off)\b)")  # "keep the mug": it takes part
_ONLY = re.compile(r"\b(?:only|just|nothing but)\b")


@dataclass(frozen=True)
class ObjectChange:
    """The change that a sentence makes to the objects that take part.

    Attributes:
        how: "replace" the objects, "add" to them, "remove" from them, "exchange" some of them for others, "swap" (as
            "exchange", unless all take part already: then it asks for their places) or "others" (those that take no
            part so far). What cannot be done is a key of `grounding.dialogue.replacements.IMPOSSIBLE`.
        text: the objects that come, or that are left; with "remove" those that go.
        out_text: with "exchange" and "swap" those that go.
        rest: the sentence without the clauses that speak of this change alone.
    """

    how: str
    text: str | None = None
    out_text: str = ""
    rest: str = ""


def clauses(text: str) -> list[str]:
    """Split a text into clauses in small letters, where a verb follows a comma or "and"."""
    said = " ".join(text.lower().replace("’", "'").replace("-", " ").split(" "))
    return [part for clause in _CLAUSE.split(said) if (part := " ".join(clause.strip(" ,").split()))]


def named_in(clause: str) -> list[Mention]:
    """Find the noun phrases that can choose objects."""
    masked = _ADVERBS.sub(lambda match: ",".ljust(len(match.group())), clause)
    found = read_mentions(masked, Vocabulary(FORMS)).mentions
    choosing = [
        m
        for m in found
        if m.noun != ANY or m.exact or m.numbers or m.ordinal or any(w in TELLING_ADJECTIVES for w in m.modifiers)
    ]
    return [m for m in choosing if clause[slice(*m.span)] != "can" or _BEFORE_A_CAN.search(clause[: m.span[0]])]


def phrase(clause: str, mentions: Sequence[Mention]) -> str:
    """Join noun phrases for `select_objects`; singulars get an article, so that "can" is not taken for a verb."""
    words = [(" ".join(clause[slice(*m.span)].split()), m) for m in mentions]
    return " and ".join(
        dict.fromkeys(w if m.plural or _COUNTED.match(w) else f"{'the' if m.definite else 'a'} {w}" for w, m in words)
    )


def object_change(text: str, edited: bool = False, shape: str | None = None) -> ObjectChange | None:
    """Find what the sentence does to the objects; `None` where they stay as they are.

    Args:
        text: a correction, any string.
        edited: whether it changes a slot in relation to what is there; then "spread the cups out" changes no objects.
        shape: of the structure that is corrected: a tower's bottom is an object's place, a line's is not.
    """
    parts = clauses(text)
    for part in parts:
        if reason := impossible(part, named_in(part), shape):
            return ObjectChange(reason)
    found: ObjectChange | None = None
    rest = []
    for part in parts:
        change = _of_clause(part, edited)
        if change is None or change.rest:
            rest.append(change.rest if change else part)
        if change is not None:
            found = change if found is None else _joined(found, change, _ONLY.search(part) is not None)
    return replace(found, rest=" , ".join(rest)) if found else None


def _of_clause(clause: str, edited: bool) -> ObjectChange | None:
    if _WHOLE_CLAUSE.fullmatch(clause):
        return ObjectChange("replace", EVERYTHING)
    if rest := _REST_WITHIN.search(clause):
        return _of_the_rest(clause, rest)
    named = named_in(clause)
    if not named:
        within = _WHOLE_WITHIN.search(clause)
        if within and not edited:
            return ObjectChange("replace", EVERYTHING, rest=clause[: within.start()] + clause[within.end() :])
        return None
    if pair := goes_and_comes(clause, named):
        out, comes, how = pair
        how = how if out else "replace"
        return ObjectChange(how, phrase(clause, comes), phrase(clause, out))
    if _KEPT.match(clause):
        return ObjectChange("add", phrase(clause, named))
    left_out = [m for m in named if m.role == "left out"]
    targets = [m for m in named if m.role == "target"]
    if not targets and (_ADDING.search(clause) or _REMOVING.search(clause)):
        targets = [m for m in named if m.role == "narrated" and m.known]  # "add the mug and we are done"
    if left_out and not targets:
        return _left_out(clause, left_out)
    if not targets:
        return None
    if _REMOVING.search(clause) or _NO.fullmatch(clause[: named[0].span[0]].strip()):
        return ObjectChange("remove", phrase(clause, named), rest=_besides(clause, named))
    kept = phrase(clause, targets) + "".join(f", but not {phrase(clause, [m])}" for m in left_out)
    if _ADDING.search(clause) and not _ONLY.search(clause):
        return ObjectChange("add", kept, rest=_besides(clause, named))
    return ObjectChange("replace", kept, rest=clause)


def _besides(clause: str, named: Sequence[Mention]) -> str:
    """Return what a clause says apart from the change of objects; empty if nothing."""
    besides = clause
    for mention in reversed(named):
        besides = _ARTICLE.sub("", besides[: mention.span[0]]) + besides[mention.span[1] :]
    return "" if _COMING_AND_GOING.issuperset(besides.replace(",", " ").split()) else clause


def _left_out(clause: str, left_out: list[Mention]) -> ObjectChange:
    """Return the change to all objects except these, or to remove these."""
    these = phrase(clause, left_out)
    if re.search(r"\b(?:everything|all|anything|everyone|every)\b", clause[: left_out[0].span[0]]):
        return ObjectChange("replace", f"everything but {these}", rest=clause)
    return ObjectChange("remove", these, rest=_besides(clause, left_out))


def _of_the_rest(clause: str, rest: re.Match[str]) -> ObjectChange | None:
    without = clause[: rest.start()] + clause[rest.end() :]
    if named_in(without):
        return None
    if re.search(r"\b(?:leave|keep|don't|do not|not|without)\b", clause):
        return None
    if PLACING.search(clause):
        return ObjectChange("apart")
    alone = re.search(r"\b(?:same|again|instead|only|just|now)\b", without) and not _ADDING.search(clause)
    return ObjectChange("others" if alone else "replace", None if alone else EVERYTHING, rest=without)


def _joined(one: ObjectChange, other: ObjectChange, only: bool) -> ObjectChange:
    """Combine the changes of two clauses; `only` says that the second one excludes everything else."""
    if one.how == "replace" and other.how == "remove":
        return replace(one, text=f"{one.text}, but not {other.text}")
    if one.how == "remove" and other.how == "replace" and not only and other.text != EVERYTHING:
        other = replace(other, how="add")  # "drop the banana and use the cube"
    if {one.how, other.how} <= {"add", "remove", "exchange", "swap"}:
        comes = [c.text for c in (one, other) if c.how != "remove" and c.text]
        out = [c.out_text if c.how in ("exchange", "swap") else c.text for c in (one, other) if c.how != "add"]
        if not out or not comes:
            return replace(one, text=" and ".join(filter(None, (one.text, other.text))))
        return ObjectChange("exchange", " and ".join(comes), " and ".join(filter(None, out)))
    if one.how == other.how == "replace" or (one.how, other.how) == ("replace", "add"):
        return replace(one, text=EVERYTHING if EVERYTHING in (one.text, other.text) else f"{one.text} and {other.text}")
    return other
