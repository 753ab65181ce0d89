"""Say phrases of places in the words that the patterns of relations know."""

from __future__ import annotations

from grounding.goal_reading.tokens import Words, joined

_SPEAKERS = ("me", "us", "myself")
_LONGEST_PHRASE = 6  # words between "between" and "and me"


def reworded(said: Words) -> Words:
    """Say "to the box's left" as "to the left of the box", and "between me and the box" as "in front of the box"."""
    return _before_the_speaker(_possessives_apart(said))


def _before_the_speaker(said: Words) -> Words:
    """Say "between me and the box" and "between the box and me" as "in front of the box"."""
    words, spans = list(said.words), list(said.spans)
    for at in range(len(words) - 1, -1, -1):
        if words[at] != "between":
            continue
        if words[at + 1 : at + 2] and words[at + 1] in _SPEAKERS and words[at + 2 : at + 3] == ["and"]:
            words[at : at + 3] = ["in", "front", "of"]
            continue
        end = next((k for k in range(at + 2, min(at + 2 + _LONGEST_PHRASE, len(words) - 1)) if words[k] == "and"), None)
        if end is not None and words[end + 1] in _SPEAKERS:
            del words[end : end + 2], spans[end : end + 2]
            words[at : at + 1], spans[at : at + 1] = ["in", "front", "of"], [spans[at]] * 3
    return joined(said.text, words, spans)


def _possessives_apart(said: Words) -> Words:
    """Say "to the box's left" as "to the left of the box", and "on the box's left side" likewise."""
    words, spans = list(said.words), list(said.spans)
    for at in range(len(words) - 3):
        owner = words[at + 2]
        if (
            words[at] in ("to", "on")
            and words[at + 1] in ("the", "my")
            and owner.endswith("'s")
            and words[at + 3] in ("left", "right")
        ):
            side = 1 if words[at + 4 : at + 5] == ["side"] else 0
            end = at + 4 + side
            last = spans[end - 1]
            words[at:end] = [words[at], "the", words[at + 3], "of", "the", owner.removesuffix("'s")]
            spans[at:end] = [spans[at], spans[at + 1], spans[at + 3], last, spans[at + 1], spans[at + 2]]
    return joined(said.text, words, spans)
