"""Apply what a speaker takes back: "on the left, no, sorry, right", "the mug, no wait, the bowl instead"."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.ellipsis import OPPOSITES, RELATION_OF_SIDE
from grounding.goal_reading.frame import PREDICATES
from grounding.references.lexicon import VESSELS
from grounding.references.phrases import ANY

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
        if chunk.kind == "correction" or _restricts(kept, chunks, at):
            at = _corrected(kept, chunks, at + 1)
        elif chunk.kind == "not":
            at = _denied(kept, chunks, at)
        else:
            kept.append(chunk)
            at += 1
    return _moves_joined(kept)


def _restricts(kept: list[Chunk], chunks: list[Chunk], at: int) -> bool:
    """Return whether the next sentence only says which objects: "put the cups in a row. Only the blue ones"."""
    if chunks[at].kind != "stop" or at + 1 >= len(chunks) or chunks[at + 1].kind != "noun phrase":
        return False
    only = chunks[at + 1].said.lower().split()[0] in ("only", "just")
    end = at + 2
    while end < len(chunks) and chunks[end].kind == "noise":
        end += 1
    ends = end == len(chunks) or chunks[end].kind in _ENDS
    return only and ends and any(chunk.kind == "noun phrase" and chunk.value.many for chunk in kept)


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
    if kind == "relation" and (after := _other_relation(kept, chunks, end)):
        return after
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


def _other_relation(kept: list[Chunk], chunks: list[Chunk], at: int) -> int:
    """Return the place after a relation that is denied for another one of the same object, or 0.

    "not on but behind the box", "behind instead of in front of the box".
    """
    following = [chunk.kind for chunk in chunks[at + 1 : at + 3]]
    if kept and kept[-1].kind == "relation" and following[:1] == ["noun phrase"]:
        return at + 1
    return at + 2 if following == ["comma", "relation"] else 0


def _corrected(kept: list[Chunk], chunks: list[Chunk], at: int) -> int:
    """Put what follows a correction in place of what it takes back; return the place after it."""
    end = _fragment_end(chunks, at)
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
    if said[0].kind == "reversed":
        if not _reversed(kept):
            kept.append(replace(said[0], kind="unknown"))
        return end
    if said[0].kind == "verb" and not _made_it(said):
        del kept[_clause(kept) :]
        kept += fragment
        return end
    again = _said_again(kept, said, chunks, end)
    if again:
        del kept[_clause(kept) :]
        return again
    if _made_it(said):
        said, fragment = said[2:], [chunk for chunk in fragment if chunk in said[2:]]
    _replace(kept, said, fragment)
    return end


def _fragment_end(chunks: list[Chunk], at: int) -> int:
    """Return where a correction ends: at a stop, or where something of its own is said: "left, and the knife behind it"."""
    end, placed = at, False
    while end < len(chunks) and chunks[end].kind not in _ENDS and chunks[end].kind != "correction":
        if chunks[end].kind in ("comma", "and") and end > at:
            after = end
            while after < len(chunks) and chunks[after].kind in ("comma", "and", "noise"):
                after += 1
            kinds = [chunk.kind for chunk in chunks[after : after + 2]]
            own = len(kinds) == 2 and kinds[0] == "noun phrase" and kinds[1] in PREDICATES
            if kinds[:1] == ["verb"] or (placed and own):
                return end
        placed = placed or chunks[end].kind in PREDICATES
        end += 1
    return end


def _said_again(kept: list[Chunk], said: list[Chunk], chunks: list[Chunk], end: int) -> int:
    """Return the place of a verb that begins the clause once more, or 0: "no, the cans, stack the cans on the right"."""
    verb = next((i for i in range(end, len(chunks)) if chunks[i].kind not in ("comma", "and", "noise")), None)
    first = _clause(kept)
    if verb is None or first >= len(kept) or any(chunk.kind != "noun phrase" for chunk in said):
        return 0
    same = chunks[verb].kind == kept[first].kind == "verb" and chunks[verb].value == kept[first].value
    return verb if same else 0


def _reversed(kept: list[Chunk]) -> bool:
    """Exchange the last two sides, or the objects of the last relation, as "the other way round" asks; tell whether."""
    sides = [i for i in range(len(kept)) if kept[i].kind in ("place", "relation", "relation it")][-2:]
    turned = [_turned(kept[i]) for i in sides]
    if len(sides) == 2 and None not in turned and _side(kept[sides[0]]) == _side(turned[1]):  # type: ignore[arg-type]
        for i, chunk in zip(sides, turned, strict=True):
            kept[i] = chunk  # type: ignore[call-overload]
        return True
    if len(sides) == 2 and kept[sides[0]].kind == kept[sides[1]].kind == "place":
        one, other = (kept[i] for i in sides)
        kept[sides[0]], kept[sides[1]] = replace(one, value=other.value), replace(other, value=one.value)
        return True
    phrases = [i for i in range(_clause(kept), len(kept)) if kept[i].kind == "noun phrase"]
    if len(sides) == 1 and len(phrases) == 2 and phrases[0] < sides[0] < phrases[1]:
        kept[phrases[0]], kept[phrases[1]] = kept[phrases[1]], kept[phrases[0]]
        return True
    return False


def _turned(chunk: Chunk) -> Chunk | None:
    """Return a place or a relation on the opposite side; `None` where there is none."""
    if chunk.kind != "place":
        return replace(chunk, value=OPPOSITES[chunk.value]) if chunk.value in OPPOSITES else None
    return None if chunk.value.opposite is None else replace(chunk, value=chunk.value.opposite)


def _side(chunk: Chunk) -> str:
    """Return the side that a place or a relation speaks of."""
    if chunk.kind != "place":
        return str(chunk.value)
    return RELATION_OF_SIDE.get(chunk.value.x_position or chunk.value.y_position or "", "")


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


def _replace(kept: list[Chunk], said: list[Chunk], fragment: list[Chunk]) -> None:
    """Put each chunk of a correction in the place of the last one that it can stand for."""
    first = said[0]
    if first.kind == "noun phrase":
        after = next((chunk for chunk in fragment[fragment.index(first) + 1 :] if chunk.kind != "noise"), None)
        if after is not None and after.kind in ("relation", "place", "shape"):
            del kept[_clause(kept) :]
            kept += said
            return
    used: set[int] = set()
    for number, chunk in enumerate(said):
        if chunk.kind == "place" and (related := _of_relation(kept, chunk)) is not None:
            kept[related] = replace(kept[related], value=_side(chunk), said=chunk.said)
            continue
        if (length := _in_units(kept, chunk)) is not None:
            kept[length[0]] = length[1]
            continue
        kinds = _ALIKE.get(chunk.kind, (chunk.kind,))
        place = _object(kept, chunk) if chunk.kind == "noun phrase" else _last(kept, kinds, used)
        if chunk.kind in ("relation", "relation it") and place is not None:
            _replace_relation(kept, place, said[number:])
            return
        if place is None:
            kept.append(chunk)
        elif chunk.kind == "length" and kept[place].kind != "length":
            kept[place] = replace(kept[place], metres=chunk.metres)
        else:
            kept[place] = chunk
            used.add(place)


def _replace_relation(kept: list[Chunk], place: int, said: list[Chunk]) -> None:
    """Put a relation in the place of one, with its object where another one is named: "I mean behind it"."""
    end = place + 1 + (place + 1 < len(kept) and kept[place + 1].kind == "noun phrase")
    named = len(said) > 1 and said[1].kind == "noun phrase" and said[1].value.kind != "pronoun"
    reference = said[1:2] if named or end == place + 1 else kept[place + 1 : end]
    kept[place:end] = [replace(said[0], kind="relation"), *reference]


def _of_relation(kept: list[Chunk], chunk: Chunk) -> int | None:
    """Return the relation for which only a side is said: "right of the plate, I mean left"; `None` for none."""
    clause = range(_clause(kept), len(kept))
    if not _side(chunk) or any(kept[i].kind in ("place", "along", "inner", "move") for i in clause):
        return None
    return next((i for i in reversed(clause) if kept[i].kind == "relation" and kept[i].value in OPPOSITES), None)


def _in_units(kept: list[Chunk], chunk: Chunk) -> tuple[int, Chunk] | None:
    """Return the last length with the number that a correction gives: "5 cm, no, 3"; `None` where it gives none."""
    if chunk.kind != "unknown" or not re.fullmatch(r"\d+(?:[.,]\d+)?", chunk.said):
        return None
    for place in range(len(kept) - 1, -1, -1):
        number = re.search(r"\d+(?:[.,]\d+)?", kept[place].said)
        if kept[place].metres is not None and number is not None and float(number.group().replace(",", ".")) > 0:
            unit = kept[place].metres / float(number.group().replace(",", "."))
            return place, replace(kept[place], metres=unit * float(chunk.said.replace(",", ".")))
    return None


def _object(kept: list[Chunk], chunk: Chunk) -> int | None:
    """Return the noun phrase for which another one is said: the last one, unless that is none to put something in."""
    last = _last(kept, ("noun phrase",))
    said = chunk.value.mention
    within = last is not None and last > 0 and kept[last - 1].kind == "relation" and kept[last - 1].value == "in"
    if within and said is not None and said.noun != ANY and said.noun not in VESSELS:
        phrases = [i for i in range(_clause(kept), len(kept)) if kept[i].kind == "noun phrase"]
        return phrases[0]
    return last


def _last(chunks: list[Chunk], kinds: tuple[str, ...], used: Collection[int] = ()) -> int | None:
    return next((i for i in range(len(chunks) - 1, -1, -1) if chunks[i].kind in kinds and i not in used), None)
