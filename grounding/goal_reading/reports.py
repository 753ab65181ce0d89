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
