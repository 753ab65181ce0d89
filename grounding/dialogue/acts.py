"""Classify what a line in a conversation does besides asking for a structure: greet, thank, or ask a question.

Only text is used. A line counts as such an act only if every word of it is accounted for: an instruction in the form of
a question ("can you stack the cans?", "what about a circle"), and an instruction with a greeting or a question beside
it ("hello, put the cups in a line"), stay instructions as a whole.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from grounding.dialogue.act_words import COLORS, NO_THING, PARTS, RELATIONS_SAID, WORDINGS
from grounding.resolve.word_forms import FORMS

_LONGEST = 160  # characters: nobody takes more to ask what is on the table
KINDS = tuple(WORDINGS)


@dataclass(frozen=True)
class Act:
    """One thing that a line does.

    Attributes:
        kind: one of `KINDS`.
        about: the objects that it asks about, in its own words ("red cup"); empty where it asks about none.
        value: what it asks about them: with "extreme" one of `SUPERLATIVES` or `COMPARATIVES`, with "compare" one of
            the latter or "as tall as" and the like, with "color" the colours that it offers, with "why" the number of
            a candidate, with "wish" that of a part; else empty.
        relation: where they are by others, one of the values of `RELATIONS_SAID`; empty where it does not say; "or"
            with "compare" where it asks which of two it is.
        other: the objects, or the part of the table, that they are by, or compared with; in its own words.
    """

    kind: str
    about: str = ""
    value: str = ""
    relation: str = ""
    other: str = ""


def _compiled(wording: str) -> re.Pattern[str]:
    """Compile a wording to a regular expression: its parts inserted, and only named groups captured."""
    while found := re.search(r"<([A-Z_]+)>", wording):
        wording = wording.replace(found.group(), f"({PARTS[found[1]]})")
    wording = re.sub(r"<VALUE:([^<>]*)>", r"(?P<value>\1)", wording)
    return re.compile(re.sub(r"\((?!\?)", "(?:", wording))


@cache
def _patterns() -> list[tuple[str, re.Pattern[str]]]:
    """Compile all wordings, when the first line is read: a chat shows its prompt before that."""
    return [(kind, _compiled(line.strip())) for kind in KINDS for line in WORDINGS[kind].splitlines()]


_PLACED = _compiled("<THING>( (that|which) (is|are|stands?|lies?)| standing| lying)? <REL> <THE><OTHER>")
_COURTESIES = [
    (kind, re.compile(rf"(?:{_compiled(f'<{part}>').pattern})[, ]+(?=\S)"))
    for kind, part in (("greeting", "GREETING"), ("thanks", "THANKS"), ("thanks", "PRAISE"))
]
_SPELLINGS = tuple(
    (re.compile(pattern), instead)
    for pattern, instead in (
        (r"[’`´]", "'"),
        (r"\b(what|where|who|how|which)'?s\b", r"\1 is"),
        (r"\b(that|it|there|here)'s\b", r"\1 is"),
        (r"\b(what|where|who|how|they|you|we)'re\b", r"\1 are"),
        (r"\bi'?m\b", "i am"),
        (r"\bi'd like\b", "i would like"),
        (r"\bu\b", "you"),
        (r"\br\b", "are"),
        (r"\bp(?:ls|lz)\b", "please"),
        (r"\bcolours?\b|\bcolors\b", "color"),
        (r"\bgrey\b", "gray"),
    )
)
_ADDRESS = _compiled("<ADDRESS>").pattern
# What stands before or behind what is said, and says nothing itself.
_OPENER = re.compile(
    r"(?:ok|okay|so|well|and|but|now|then|um+|uh+|hm+|please|oh|ah|right|alright|all right|excuse me|sorry|listen"
    r"|wait(?! (?:a|one|for) )"
    rf"|actually|just|also|yes|yeah|hey {_ADDRESS}|{_ADDRESS}(?=,)|quick question|one question)\b[, ]*"
)
_CLOSER = re.compile(
    r"[, ]+(?:please|now|right now|just now|at the moment|at present|currently|exactly|then|though|anyway|today|here"
    rf"|actually|really|for me|by the way|thanks|thank you|{_ADDRESS})$"
)
_ASKING = re.compile(
    r"(?:(?:can|could|would|will) you (?:(?:please|just|maybe|kindly) )*(?:tell me|explain(?: to me)?|say|let me know"
    r"|remind me)|tell me|do you (?:happen to )?know|i (?:just )?(?:want|would like|need) to know|i wonder"
    r"|i was wondering|may i ask|can i ask(?: you)?|let me know|remind me)\b[,: ]*"
)
_QUESTION = re.compile(
    r"(?:who|whose|where|when|why|which|how|what(?! an? )|is|are|was|were|do|does|did|can|could|will|would|have|has)"
    r"(?:'s|'re)?\b"
)


def acts_of(text: str) -> tuple[Act, ...]:
    """Find what a line does besides asking for a structure; nothing where any part of it may be an instruction."""
    if len(text) > _LONGEST:
        return ()
    said = text.lower()
    for pattern, instead in _SPELLINGS:
        said = pattern.sub(instead, said)
    said = " ".join(re.sub(r"[^\w\s'.!?;,-]", " ", said).split())
    acts: list[Act] = []
    for clause in re.findall(r"[^.!?;]+\??", said):
        found = _acts(clause)
        if found is None:
            return ()
        acts += [act for act in found if act not in acts]
    telling = [act for act in acts if act.kind not in ("greeting", "thanks")]
    return tuple(telling or acts[:1])


def bare(text: str) -> str:
    """Strip a line of capitals, punctuation and polite words: "Ok, stop it, please!" -> "stop it"."""
    return _peeled(" ".join(re.sub(r"[^\w\s',/-]", " ", text.lower().replace("’", "'")).split()))


def is_question(text: str) -> bool:
    """Tell whether a line has the form of a question; many instructions have it too ("can you stack the cans?")."""
    said = bare(text)
    return text.rstrip().endswith("?") or _QUESTION.match(_ASKING.sub("", said, count=1)) is not None


def _peeled(said: str) -> str:
    said = said.strip(" ,")
    while (opener := _OPENER.match(said)) and opener.end() < len(said):
        said = said[opener.end() :]
    while closer := _CLOSER.search(said):
        said = said[: closer.start()]
    return said


def _acts(said: str) -> list[Act] | None:
    """Return the acts that a clause consists of; `None` if something is left over."""
    asked = said.endswith("?")
    said = said.strip("?, ")
    whole = _act(said, asked)
    if whole is not None:
        return [whole]
    for kind, courtesy in _COURTESIES:
        if begun := courtesy.match(said):
            rest = _acts(said[begun.end() :] + "?" * asked)
            return None if rest is None else [Act(kind), *rest]
    peeled = _peeled(said)
    if begun := _ASKING.match(peeled):
        peeled = peeled[begun.end() :]
    return None if peeled in ("", said) else _acts(peeled + "?" * asked)


def _act(said: str, asked: bool) -> Act | None:
    for kind, pattern in _patterns():
        found = pattern.fullmatch(said) or (pattern.fullmatch(f"{said}?") if asked else None)
        if found is not None:
            parts = {name: words or "" for name, words in found.groupdict().items()}
            if parts.get("about") and not parts.get("other") and (placed := _PLACED.fullmatch(parts["about"])):
                parts |= placed.groupdict()  # "the thing on the plate"
            if parts.get("about") in COLORS and parts["about"] not in FORMS:  # an orange is a fruit
                parts["about"] += " objects"
            relation = parts.get("relation", "")
            parts["relation"] = RELATIONS_SAID.get(relation, relation)
            if all(NO_THING.isdisjoint(re.split(r"[ -]", parts.get(name, ""))) for name in ("about", "other")):
                return Act(kind, *(parts.get(name, "") for name in ("about", "value", "relation", "other")))
    return None
