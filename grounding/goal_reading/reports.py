"""Drop the parts of an instruction that only report something: "my guests arrive at eight, so ..."."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goal_reading.beyond import known
from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.clauses import Clauses
from grounding.goal_reading.frame import PREDICATES
from grounding.goal_reading.tokens import Words


def without_reports(
    chunks: list[Chunk], said: Words, clauses: Clauses, narrated: Sequence[bool]
) -> list[Chunk]:
    """Drop what only reports something: "my guests arrive at eight, so ...", if it says nothing that a goal could hold.

    Args:
        chunks: of the instruction.
        said: its words.
        clauses: tells what could be a wish in them.
        narrated: for each word, whether its sentence only reports something.
    """
    kept: list[Chunk] = []
    run: list[Chunk] = []
    for chunk in [*chunks, None]:
        if chunk is not None and not _parts(chunk, run):
            run.append(chunk)
            continue
        told = run and (all(all(narrated[one.first : one.end]) for one in run) or said.word(run[0].first) in _SUBJECTS)
        told = told and said.word(run[0].first) not in _CONDITIONS
        if told and (subject := _subject_of_event(run)) is not None and not _asked(run, said):
            kept += subject
            run = []
            if chunk is not None:
                kept.append(chunk)
            continue
        numbers = any(said.word(i).isdecimal() for one in run for i in range(one.first, one.end))
        kept += [] if told and not numbers and _reports(run) and not clauses.wishes(run[0].first, run[-1].end) else run
        run = []
        if chunk is not None:
            kept.append(chunk)
    return kept


def _parts(chunk: Chunk, run: Sequence[Chunk]) -> bool:
    """Return whether a new thought begins here."""
    so = chunk.kind == "noise" and chunk.said.lower().split()[0] == "so" and bool(run) and run[-1].kind == "comma"
    return chunk.kind == "stop" or chunk.said == ":" or so


def _reports(run: Sequence[Chunk]) -> bool:
    """Return whether these chunks have words that are not understood, and nothing that could ask for something."""
    if not any(one.kind == "unknown" for one in run) or any(one.kind == "verb" for one in run):
        return False
    if any(one.value in _PAST for one in run if one.kind == "unknown"):
        return True
    asks = any(one.kind in PREDICATES and one.kind not in ("place", "size", "inner", "relation") for one in run)
    return not asks and not any(
        one.kind == "relation" and other.kind == "noun phrase" and known([other.value])
        for one, other in zip(run, run[1:], strict=False)
    )


def _subject_of_event(run: Sequence[Chunk]) -> list[Chunk] | None:
    """Return the objects of which something is told that is over: "the mugs" in "the mugs came in a big parcel".

    They stay, for what follows may speak of "them". `None` where nothing of that kind is told.
    """
    subject = next((i for i, one in enumerate(run) if one.kind not in ("noise", "comma", "and")), None)
    if subject is None or run[subject].kind != "noun phrase":
        return None
    event = next((i for i, one in enumerate(run) if _event(run, i, subject)), None)
    if event is None or event <= subject or any(one.kind in ("shape", "verb") and i != event for i, one in enumerate(run)):
        return None
    told = run[event:]
    if any(one.kind in ("comma", "and") and after.kind == "noun phrase" for one, after in zip(told, told[1:], strict=False)):
        return None  # "the cans came today, the bowls on the left"
    return list(run[: subject + 1]) if known([run[subject].value]) else []


def _event(run: Sequence[Chunk], at: int, subject: int) -> bool:
    """Return whether a verb stands here that only tells something: "came", or "are from" right after the subject."""
    one = run[at]
    if one.kind == "unknown" and one.value in _EVENTS:
        return True
    said = [each.said.lower() for each in run[at : at + 2]]
    if said[0] in ("has", "had") and len(said) == 2 and said[1].split()[0] in ("a", "an", "no", "some"):
        return True  # "the bowl at the back has a crack"
    return one.kind == "noise" and at == subject + 1 and (said[0] in ("was", "were") or said in (["is", "from"], ["are", "from"]))


def _asked(run: Sequence[Chunk], said: Words) -> bool:
    """Return whether a word of these chunks may ask for something after all."""
    return any(said.word(i) in _ASKING for one in run for i in range(one.first, one.end))


# Verbs in a tense that never asks for anything.
_EVENTS = frozenset(
    "came arrived fell broke cost belonged went won got survived leaked burst disappeared appeared happened lay stood sat travelled traveled was were".split()
)
_ASKING = frozenset(
    "want wants wanted need needs needed should must shall ought supposed meant if wish that which who would could might may can go goes belong belongs".split()
)
_PAST = frozenset(
    "came bought lost broke fell saw said got gave told cried brought belonged went won stood was were had wasn't weren't".split()
)
_CONDITIONS = frozenset(
    "if when whenever once unless until provided".split()
)  # what depends on them is not passed over
_SUBJECTS = frozenset(
    "i we my our he she they it it's i'm i've we're we've this that there there's today tonight yesterday tomorrow because since as when if the "
    "his her their everyone someone guests people nobody mum mom dad grandma what".split()
)
