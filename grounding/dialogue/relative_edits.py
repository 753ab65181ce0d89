"""Find the relative parts of a correction: "a bit bigger", "further left", "turn it around", "forget the size".

Patterns over a sentence in small letters, without punctuation but commas. Each says by how much which slot of
the last specification changes, whatever that was; `grounding.dialogue.revise` computes the new value.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from grounding.dialogue.relative_patterns import PATTERNS

_OF_THE_ROBOT = re.compile(r"\b(?:robot|arm|your|you(?! can))\b")
_TOKEN = re.compile(r"\d+|[^\W\d_]+(?:['’][^\W\d_]+)*|[,°]")


@dataclass(frozen=True)
class Edit:
    """One change of one slot.

    Attributes:
        slot: the slot; "position" for both positions; "side", "end" and "corner" for the other one of these;
            "center", "elsewhere" and "height".
        how: "step" along the slot's values, "most" to their end, "flip" to the opposite, "turn" clockwise
            seen from above, "clear" to unspecified, "not" to leave one value, "keep" where it is denied,
            "ask" where it cannot be known.
        by: the direction of a step (1 or -1), the number of quarter turns (`None` for other angles), or the
            place of the value that is not wanted.
        words: the words that say so.
    """

    slot: str
    how: str
    by: int | None = 0
    words: str = ""

    def seen_from_across(self) -> Edit:
        """Reverse what was said of the robot ("closer to you"), for a speaker on the opposite side."""
        of_the_robot = self.slot in ("x_position", "y_position") and _OF_THE_ROBOT.search(self.words)
        return replace(self, by=-(self.by or 0)) if of_the_robot and self.how in ("step", "most") else self


_TURN = re.compile(
    r"\b(?:(?P<verb>rotate|turn|spin|swivel|swing|twist|clockwise|anticlockwise"
    r"|counterclockwise)\b)(?P<rest>(?: [\w'°]+){0,9})"
)
_ANGLE = re.compile(
    r"\b(?:(?P<degrees>\d{1,4}) ?(?:degrees?|deg|°)"
    r"|(?P<half>half(?: a)? ?(?:turn|rotation|way)?|a half turn)"
    r"|(?P<three>three quarters?(?: turns?)?)|(?P<quarter>(?:a |one )?quarter(?: of a)?(?: turn)?"
    r"|right angle|ninety degrees))"
)
_CLOCKWISE = re.compile(r"\b(?P<anti>(?:anti|counter) ?)?clockwise\b|\bto the (?P<side>left|right)\b")
_HEADING = re.compile(
    r"\b(?:to|towards?|so|until|facing|faces?|around|round|about|other|opposite|left|right|away)\b"
)
_SLIGHTLY = re.compile(r"\b(?:a (?:little|tiny|small )?(?: ?bit|touch|tad|little|notch)|slightly|somewhat)\b")
_TIMES = {"twice": 2, "two times": 2, "three times": 3}
_VERBS_OF_TURNING = ("rotate", "spin", "twist", "swivel")
_NEGATED = re.compile(r"(?:\b(?:don't|do not|never|not|no)(?: \w+){0,2}) $")


def normalized(text: str) -> str:
    """Normalize a sentence for the patterns: small letters, single spaces, commas as words."""
    return " ".join(match.replace("’", "'") for match in _TOKEN.findall(text.lower().replace("-", " ")))


def relative_edits(sentence: str) -> tuple[list[Edit], str]:
    """Find the relative changes in a normalized sentence, in its order, and the sentence without their words."""
    found: list[tuple[int, Edit]] = []
    turn = _turn(sentence)
    if turn:
        found.append(turn[:2])
        sentence = _without(sentence, turn[0], turn[2])
    for pattern, slot, how, by in PATTERNS:
        while match := pattern.search(sentence):
            denied = how in ("step", "most", "flip") and _NEGATED.search(sentence[: match.start()])
            found.append((match.start(), Edit(slot, "keep" if denied else how, by, match.group())))
            sentence = _without(sentence, match.start(), match.end())
    return [edit for _, edit in sorted(found, key=lambda pair: pair[0])], " ".join(
        sentence.replace("#", " ").split()
    )


def _without(sentence: str, start: int, end: int) -> str:
    return sentence[:start] + "#" * (end - start) + sentence[end:]


def _turn(sentence: str) -> tuple[int, Edit, int] | None:
    """Return a turn by an angle or in a direction, with its place; by `None` if neither is given, or not in
    quarters.
    """
    match = _TURN.search(sentence)
    if not match:
        return None
    words = match.group()
    angle, sense = _ANGLE.search(words), _CLOCKWISE.search(words)
    # "a quarter turn clockwise", "a half turn"
    earlier = _ANGLE.search(sentence, max(0, match.start() - 30), match.end()) if not angle else None
    clock = sense is not None and sense.group("side") is None
    if not (angle or earlier or clock):
        # "rotate it": by how much? "turn it to the left" is for the parser.
        alone = re.fullmatch(r"turn(?: it| them| this| that)?(?: please)?", words)
        vague = alone or (match.group("verb") in _VERBS_OF_TURNING and not _HEADING.search(words))
        slightly = re.match(r"\w+ (?:it|them|this|that|the \w+) ", words) and _SLIGHTLY.search(words)
        vague = vague or (slightly and sense is not None)
        return (match.start(), Edit("rotation", "turn", None, words), match.end()) if vague else None
    ends = [part.end() for part in (angle, sense) if part]
    angle = angle or earlier
    quarters: int | None = 1
    if angle and angle.group("degrees"):
        degrees = int(angle.group("degrees"))
        quarters = degrees // 90 if degrees % 90 == 0 else None
    elif angle and angle.group("half"):
        quarters = 2
    elif angle and angle.group("three"):
        quarters = 3
    anti = sense is not None and (sense.group("anti") is not None or sense.group("side") == "left")
    anti = anti or match.group("verb") in ("anticlockwise", "counterclockwise")
    times = next((times for times in _TIMES if f" {times}" in f" {sentence[match.start() :]}"), "")
    if quarters is not None:
        quarters *= (-1 if anti else 1) * _TIMES.get(times, 1)
    ends += [match.start() + sentence[match.start() :].index(times) + len(times) - match.start()] if times else []
    end = match.start() + max([len(match.group("verb")), *ends])
    start = min(match.start(), earlier.start()) if earlier else match.start()
    return start, Edit("rotation", "turn", quarters, sentence[start:end]), end
