"""Apply what a speaker takes back: "on the left, no, sorry, right", "the mug, no wait, the bowl instead"."""

from __future__ import annotations

from dataclasses import replace

from grounding.goal_reading.chunk import Chunk

_ENDS = frozenset(("stop", "then"))
# What a fragment after a correction replaces, besides the same kind.
_ALIKE = {
    "place": ("place", "along", "inner"), "along": ("along", "place"), "grid": ("grid", "shape"), "shape": ("shape", "grid", "stacked", "side by side"),
    "length": ("gap", "radius", "length of", "away", "move", "apart", "length", "diameter"), "inner": ("inner", "place"),
    "relation": ("relation", "place", "apart"), "move": ("move", "length", "away"),
}  # fmt: skip


def without_corrections(chunks: list[Chunk]) -> list[Chunk]:
    """Return the chunks of what stands in the end."""
    kept: list[Chunk] = []
    at = 0
    while at < len(chunks):
        chunk = chunks[at]
        if chunk.kind == "correction":
            at = _corrected(kept, chunks, at + 1)
        elif chunk.kind == "not":
            at = _denied(kept, chunks, at)
        else:
            kept.append(chunk)
            at += 1
    return _moves_joined(kept)


def _moves_joined(chunks: list[Chunk]) -> list[Chunk]:
    """Join a length with the direction after it, where something stood between them: "10 cm, I mean 15 cm, to the left"."""
    kept: list[Chunk] = []
    for chunk in chunks:
        before = [one for one in kept[-2:] if one.kind != "comma"]
        sideways = (
            chunk.kind == "place" and chunk.value.x_position in ("left", "right") and chunk.value.y_position is None
        )
        if sideways and before and before[-1].kind in ("length", "away"):
            while kept[-1].kind == "comma":
                kept.pop()
            length = kept.pop()
            kept.append(
                replace(chunk, kind="move", value=chunk.value.x_position, metres=length.metres, first=length.first)
            )
        else:
            kept.append(chunk)
    return kept


def _denied(kept: list[Chunk], chunks: list[Chunk], at: int) -> int:
    """Drop what "not" or "instead of" takes out: one chunk, with the objects of a relation."""
    end = at + 1
    while end < len(chunks) and chunks[end].kind == "noise":
        end += 1
    if end >= len(chunks):
        kept.append(Chunk("unknown", "not", chunks[at].first, chunks[at].end, said=chunks[at].said))
        return end
    kind = chunks[end].kind
    if kind in ("place", "inner", "shape", "size", "rotation", "along", "order", "noun phrase", "gap", "grid"):
        end += 1
    elif kind == "relation" and end + 1 < len(chunks) and chunks[end + 1].kind == "noun phrase":
        end += 2
    else:
        kept.append(Chunk("unknown", "not", chunks[at].first, chunks[at].end, said=chunks[at].said))
        return at + 1
    # "not on the left but on the right", "not the red one, the blue one"
    following = end
    while following < len(chunks) and (
        chunks[following].kind in ("comma", "noise") or chunks[following].said.lower() == "but"
    ):
        following += 1
    replaced = following > end and following < len(chunks) and chunks[following].kind == kind
    last = _last(kept, (kind,))
    joined = kept and kept[-1].kind in ("comma", "and")
    if replaced and last is not None and kind == "noun phrase" and joined:
        del kept[last:]
        return following
    if joined and not replaced:
        kept.pop()
    if not replaced and kind == "noun phrase" and last is not None and kept[last].value.kind in ("all", "rest"):
        kept += [replace(chunks[at], kind="except", value=True), chunks[end - 1]]  # "everything, not the cans"
    elif not replaced and _last(kept, ("place", "inner", "along")) is None and kind in ("place", "inner", "along"):
        said = f"{chunks[at].said} {chunks[end - 1].said}"  # where it should not be, and not where it should
        kept.append(Chunk("unknown", "not", chunks[at].first, chunks[end - 1].end, said=said.strip(" ,")))
    return following if replaced else end


def _corrected(kept: list[Chunk], chunks: list[Chunk], at: int) -> int:
    """Put what follows a correction in place of what it takes back; return the place after it."""
    end = at
    while end < len(chunks) and chunks[end].kind not in _ENDS and chunks[end].kind != "correction":
        end += 1
    fragment = [
        chunk
        for chunk in chunks[at:end]
        if not (chunk.kind == "noise" and chunk.said.lower() in ("instead", "please", "rather"))
    ]
    while kept and kept[-1].kind in ("comma", "stop", "noise", "and"):
        kept.pop()
    said = [chunk for chunk in fragment if chunk.kind not in ("noise", "comma", "and")]
    if not said:
        return end
    if said[0].kind == "not":
        return at
    if said[0].kind == "verb" and not _made_it(said):
        del kept[_clause(kept) :]
        kept += fragment
        return end
    if _made_it(said):
        said = said[2:]
    _replace(kept, said)
    return end


def _made_it(said: list[Chunk]) -> bool:
    """Return whether the correction is "make it a line": what was said of the same objects."""
    return (
        len(said) > 2 and said[0].kind == "verb" and said[1].kind == "noun phrase" and said[1].value.kind == "pronoun"
    )


def _clause(kept: list[Chunk]) -> int:
    """Return where the last clause begins: at its verb, or after the last stop."""
    for place in range(len(kept) - 1, -1, -1):
        if kept[place].kind in ("verb", "stop", "then"):
            return place if kept[place].kind == "verb" else place + 1
    return 0


def _replace(kept: list[Chunk], said: list[Chunk]) -> None:
    first = said[0]
    if first.kind == "noun phrase" and len(said) > 1 and said[1].kind in ("relation", "place", "shape"):
        del kept[_clause(kept) :]
        kept += said
        return
    used: set[int] = set()
    for number, chunk in enumerate(said):
        kinds = _ALIKE.get(chunk.kind, (chunk.kind,))
        place = _last([one for one in kept], kinds, used)
        if chunk.kind == "relation" and place is not None:
            after = said[number + 1 :]
            if after and after[0].kind == "noun phrase":
                end = place + 1 + (place + 1 < len(kept) and kept[place + 1].kind == "noun phrase")
                kept[place:end] = [chunk, after[0]]
                return
        if place is None:
            kept.append(chunk)
        elif chunk.kind == "length" and kept[place].kind != "length":
            kept[place] = replace(kept[place], metres=chunk.metres)
        else:
            kept[place] = chunk
            used.add(place)


def _last(chunks: list[Chunk], kinds: tuple[str, ...], used: set[int] = frozenset()) -> int | None:  # type: ignore[assignment]
    return next((i for i in range(len(chunks) - 1, -1, -1) if chunks[i].kind in kinds and i not in used), None)
