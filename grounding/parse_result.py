"""Define the result of a parser: the slots and their probabilities, a refusal, or a question.

Both parsers give probabilities per slot and of the reasons to refuse; `decide` makes one `Parse` of
them, so that the parsers differ only in how they read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from grounding.spec import SHAPES, SLOTS, SLOTS_OF_SHAPE, StructureSpec

STATUSES = ("ok", "ask", "refused")
DEFECT = "defect"  # of a text at which the program itself failed: nothing is known of what it asks for
# Why an instruction is refused, and what is said of it.
REFUSALS: Mapping[str, str] = {
    "idle": "does not ask for an arrangement of objects",
    "unbuildable": "asks for a shape that cannot be built",
    "several": "asks for more than one structure",
    "relation": "places single objects instead of a structure",
}
_SAY_INSTEAD = {
    "idle": f"say a shape ({', '.join(SHAPES)}), a size, a position or a rotation",
    "unbuildable": f"shapes that can be built: {', '.join(SHAPES)}, and the figures of `structagent structures list`",
    "several": f"say each of them plainly, with its objects; shapes that can be built: {', '.join(SHAPES)}",
    "relation": f"say which object goes where, or which structure they should form: {', '.join(SHAPES)}",
}
# Below this the best answer is as likely wrong as right, and asking costs less than building it.
LEAST_CERTAINTY = 0.5
OBJECT = "object"  # what a question about which object is meant asks for, in place of a slot
OPEN = "open"  # how a question offers to leave a slot as it is
# What may still be meant when the parser has to ask.
WORTH_OFFERING = 0.1
# A shape gives way to a slot that it cannot carry only where it was this much less certain.
SHAPE_PREFERENCE = 0.2


@dataclass(frozen=True)
class Question:
    """A question that must be answered before building.

    Attributes:
        slot: the slot that is missing or in doubt, or `OBJECT`, or `grounding.unsupported.CORNER`.
        text: the question, with its options. Lines before the last show what it is about.
        options: the possible values, the most likely first, including `OPEN` if the slot may stay open.
    """

    slot: str
    text: str
    options: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """Return the question without what it shows."""
        return self.text.rpartition("\n")[2]


WHICH_SHAPE = Question("shape", f"which shape should it be: {', '.join(SHAPES)}?", SHAPES)


@dataclass(frozen=True)
class Parse:
    """The slots that were understood, as spoken: positions and headings are the speaker's own.

    Attributes:
        text: the instruction.
        spec: the slots; `None` if the instruction leaves them open. Empty if refused, the best
            reading if there is a question.
        parser: which parser read it.
        status: "ok", "ask" or "refused".
        message: why it is refused, or the question; empty otherwise.
        question: only with "ask".
        confidence: slot -> probability of what `spec` says of it; empty if the parser cannot say.
        evidence: slot -> the words that the answer rests on, for the specified slots.
        dropped: slot -> value that was parsed but cannot go with the rest, such as a tower's size.
        prompt_sha256: checksum of the prompt, if there is one.
    """

    text: str
    spec: StructureSpec
    parser: str
    status: str = "ok"
    message: str = ""
    question: Question | None = None
    confidence: Mapping[str, float] = field(default_factory=dict)
    evidence: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    dropped: Mapping[str, str] = field(default_factory=dict)
    prompt_sha256: str | None = None


Slots = Parse | Callable[[], Parse]  # of a text, or what reads them when they are looked at


def parse_of(slots: Slots) -> Parse:
    """Return the five slots, read now if they were not before."""
    return slots if isinstance(slots, Parse) else slots()


class Parser(Protocol):
    """Any reader of instructions. It returns one `Parse` for every text, never an error."""

    name: str

    def parse(self, text: str) -> Parse:
        """Parse one instruction."""

    def parse_batch(self, texts: Sequence[str]) -> list[Parse]:
        """Parse each of many instructions."""


def refusal(text: str, reason: str, parser: str, **more: object) -> Parse:
    """Make the parse of an instruction that is refused for one of `REFUSALS`."""
    message = f"{shortened(text)!r} {REFUSALS[reason]}; {_SAY_INSTEAD[reason]}"
    return Parse(text, StructureSpec(), parser, "refused", message, **more)  # type: ignore[arg-type]


def unreadable(text: str, why: str, parser: str) -> Parse:
    """Make the parse of a text that no parser can take: empty, too long, without a word."""
    return Parse(text, StructureSpec(), parser, "refused", why)


def decide(
    text: str,
    probabilities: Mapping[str, Mapping[str | None, float]],
    evidence: Mapping[str, tuple[str, ...]],
    refusals: Mapping[str, float],
    parser: str,
    prompt_sha256: str | None = None,
) -> Parse:
    """Choose the parse that the probabilities support.

    Args:
        text: the instruction.
        probabilities: slot -> value or `None` -> probability, for all five slots.
        evidence: slot -> telling words, where known.
        refusals: reason -> probability; the remainder to 1 is the probability of building.
        parser: the parser's name.
        prompt_sha256: checksum of the prompt, if there is one.
    """
    reason = max(refusals, key=refusals.__getitem__, default=None)
    if reason is not None and sum(refusals.values()) >= LEAST_CERTAINTY:
        return refusal(text, reason, parser, prompt_sha256=prompt_sha256)
    answers = {slot: max(probabilities[slot], key=probabilities[slot].__getitem__) for slot in SLOTS}
    kept = make_legal(answers, {slot: probabilities[slot][answers[slot]] for slot in SLOTS})
    question = _question(text, kept, probabilities)
    return Parse(
        text=text,
        spec=StructureSpec(**kept),
        parser=parser,
        status="ask" if question else "ok",
        message=question.text if question else "",
        question=question,
        confidence={slot: float(probabilities[slot][kept[slot]]) for slot in SLOTS},
        evidence={slot: evidence[slot] for slot in SLOTS if kept[slot] is not None and slot in evidence},
        dropped={slot: value for slot in SLOTS if (value := answers[slot]) is not None and value != kept[slot]},
        prompt_sha256=prompt_sha256,
    )


def make_legal(answers: Mapping[str, str | None], certainty: Mapping[str, float]) -> dict[str, str | None]:
    """Drop answers that exclude each other: the less certain gives way, a shape last."""
    kept = dict(answers)
    illegal = [slot for slot in SLOTS[1:] if kept[slot] is not None and slot not in SLOTS_OF_SHAPE[kept["shape"]]]
    if any(certainty["shape"] + SHAPE_PREFERENCE < certainty[slot] for slot in illegal):
        kept["shape"] = None
    else:
        kept.update(dict.fromkeys(illegal))
    return kept


def shortened(text: str, limit: int = 80) -> str:
    """Put the text on one line and shorten it if it is long."""
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _question(
    text: str, kept: Mapping[str, str | None], probabilities: Mapping[str, Mapping[str | None, float]]
) -> Question | None:
    if not any(kept.values()):
        return WHICH_SHAPE
    doubtful = [slot for slot in SLOTS if probabilities[slot][kept[slot]] < LEAST_CERTAINTY]
    for slot in doubtful[:1]:
        ranked = sorted(probabilities[slot].items(), key=lambda item: -item[1])
        options = [value or OPEN for value, share in ranked if share >= WORTH_OFFERING]
        if len(options) > 1:
            said = " or ".join([", ".join(options[:-1]), options[-1]])
            name = slot.replace("_", " ")
            return Question(slot, f"the {name} in {shortened(text)!r} is not clear: {said}?", tuple(options))
    return None
