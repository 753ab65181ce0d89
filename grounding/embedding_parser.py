"""Sentences to specs by the sentence encoder's word embeddings, with a confidence per slot.

A mean over a whole sentence blurs "small cups in a circle" with "cups in a small circle", so the
parser reads the encoder's contextual word embeddings and lets attention pick the telling words.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from grounding.encoder import MAX_TOKENS, SentenceEncoder
from grounding.spec import SHAPES, SLOTS, SLOTS_OF_SHAPE, StructureSpec

if TYPE_CHECKING:
    import torch

    from grounding.slot_reader import SlotReader

WEIGHTS = Path(__file__).parent / "weights"
# A word is evidence if it carries at least this share of what the strongest word carries.
EVIDENCE_SHARE = 0.3
# A shape gives way to a slot that it cannot carry only where it was this much less certain.
SHAPE_PREFERENCE = 0.2


class ParseError(ValueError):
    """An instruction that cannot be understood or built; the message says what can be said instead."""


class ParserWeightsError(RuntimeError):
    """Weights of the parser that cannot be used; the message names the file and the reason."""


@dataclass(frozen=True)
class Parse:
    """What was understood.

    Attributes:
        text: the instruction.
        spec: the slots; `None` where the instruction leaves them open.
        confidence: slot -> probability of what `spec` says of it, for all five slots.
        evidence: slot -> the words that the answer rests on, for the specified slots.
        parser: which parser read it.
        dropped: slot -> value that was heard but cannot go with the rest, such as a tower's size.
    """

    text: str
    spec: StructureSpec
    confidence: Mapping[str, float]
    evidence: Mapping[str, tuple[str, ...]]
    parser: str
    dropped: Mapping[str, str] = field(default_factory=dict)


class EmbeddingParser:
    """Reads instructions by attention over the sentence encoder's word embeddings."""

    name = "embedding"

    def __init__(
        self, encoder: SentenceEncoder, reader: SlotReader, layer: int, temperatures: Mapping[str, float]
    ) -> None:
        self.encoder = encoder
        self._reader = reader.eval()
        self._layer = layer
        self._temperatures = temperatures

    @classmethod
    def from_pretrained(
        cls, folder: str | Path = WEIGHTS, encoder: SentenceEncoder | None = None
    ) -> EmbeddingParser:
        """The trained parser.

        Args:
            folder: of the `config.json` and `model.safetensors` that `grounding.train_parser` writes.
            encoder: share a loaded one; it must be the one that the parser was trained on.

        Raises:
            ParserWeightsError: for a file that is missing or does not fit, or for another encoder.
        """
        from safetensors import SafetensorError
        from safetensors.torch import load_file

        from grounding.slot_reader import SlotReader

        folder = Path(folder)
        for name in ("config.json", "model.safetensors"):
            if not (folder / name).is_file():
                raise ParserWeightsError(f"no parser weights in {folder}: {name} is missing")
        encoder = encoder or SentenceEncoder()
        try:
            config = json.loads((folder / "config.json").read_text())
            reader = SlotReader(hidden=config["hidden"])
            reader.load_state_dict(load_file(folder / "model.safetensors"))
            layer, temperatures = int(config["layer"]), {slot: config["temperatures"][slot] for slot in SLOTS}
            checksum = config["encoder_sha256"]
        except (ValueError, KeyError, RuntimeError, SafetensorError) as error:
            reason = " ".join(str(error).split())
            raise ParserWeightsError(f"the parser weights in {folder} do not fit: {reason}") from error
        if encoder.checksum != checksum:
            raise ParserWeightsError(
                f"the parser in {folder} was trained on the encoder {checksum[:12]}..., not on "
                f"{encoder.checksum[:12]}... of {encoder.folder}"
            )
        return cls(encoder, reader, layer, temperatures)

    def parse(self, text: str) -> Parse:
        """The spec that the instruction asks for.

        Raises:
            ParseError: for an empty or over-long text, one in which no slot is found, or a shape
                that cannot be built.
        """
        if not text.strip():
            raise ParseError("the instruction is empty; say what to build, as 'a small circle on the left'")
        states = self.encoder.token_states([text], self._layer)
        if states.truncated[0]:
            raise ParseError(
                f"the instruction is too long: {len(text)} characters are more than the {MAX_TOKENS} word "
                "pieces (about 180 words) that can be read; say it more briefly"
            )
        probabilities, contributions = self._read(states.hidden, states.mask)
        heard = {slot: max(options, key=options.get) for slot, options in probabilities.items()}
        evidence = {
            slot: _telling_words(text, states.spans[0], contributions[slot][value])
            for slot, value in heard.items()
            if value is not None
        }
        self._refuse(text, heard, evidence)
        certainty = {slot: probabilities[slot][value] for slot, value in heard.items()}
        kept = _make_legal(heard, certainty)
        return Parse(
            text=text,
            spec=StructureSpec(**kept),
            confidence={slot: probabilities[slot][kept[slot]] for slot in SLOTS},
            evidence={slot: evidence[slot] for slot in SLOTS if kept[slot] is not None},
            parser=self.name,
            dropped={slot: heard[slot] for slot in SLOTS if heard[slot] != kept[slot]},
        )

    def _read(
        self, hidden: torch.Tensor, mask: torch.Tensor
    ) -> tuple[dict[str, dict[str | None, float]], dict[str, dict[str | None, list[float]]]]:
        """For one text, slot -> answer -> its probability, and -> what each word piece adds to it."""
        import torch

        from grounding.slot_reader import ANSWERS

        with torch.inference_mode():
            votes = self._reader(hidden, mask)
        probabilities, contributions = {}, {}
        for slot, vote in zip(SLOTS, votes, strict=True):
            share = (vote[0].sum(dim=0) / self._temperatures[slot]).softmax(dim=-1).tolist()
            probabilities[slot] = dict(zip(ANSWERS[slot], share, strict=True))
            over_unspecified = (vote[0] - vote[0][:, -1:]).T.tolist()
            contributions[slot] = dict(zip(ANSWERS[slot], over_unspecified, strict=True))
        return probabilities, contributions

    @staticmethod
    def _refuse(text: str, heard: Mapping[str, str | None], evidence: Mapping[str, tuple[str, ...]]) -> None:
        shapes = ", ".join(SHAPES)
        if heard["shape"] is not None and heard["shape"] not in SHAPES:
            words = " ".join(evidence["shape"])
            raise ParseError(
                f"cannot build {words!r} in {_shortened(text)!r}; shapes that can be built: {shapes}"
            )
        if all(value is None for value in heard.values()):
            raise ParseError(
                f"instruction not understood: {_shortened(text)!r}; say a shape ({shapes}), a size, "
                "a position or a rotation"
            )


def _make_legal(heard: Mapping[str, str | None], certainty: Mapping[str, float]) -> dict[str, str | None]:
    """The answers without those that cannot go together: the less certain gives way, a shape last."""
    kept = dict(heard)
    illegal = [
        slot for slot in SLOTS[1:] if kept[slot] is not None and slot not in SLOTS_OF_SHAPE[kept["shape"]]
    ]
    if any(certainty["shape"] + SHAPE_PREFERENCE < certainty[slot] for slot in illegal):
        kept["shape"] = None
    else:
        kept.update(dict.fromkeys(illegal))
    return kept


def _telling_words(text: str, spans: list[tuple[int, int]], added: list[float]) -> tuple[str, ...]:
    """The words of the text that add most, in the order of the text."""
    words: dict[tuple[int, int], float] = {}
    for (first, last), amount in zip(spans, added, strict=True):
        if last > first:
            while first > 0 and text[first - 1].isalnum():
                first -= 1
            while last < len(text) and text[last].isalnum():
                last += 1
            words[first, last] = words.get((first, last), 0.0) + amount
    strongest = max(words.values(), default=0.0)
    if strongest <= 0.0:
        return ()
    return tuple(text[slice(*word)] for word, amount in words.items() if amount >= EVIDENCE_SHARE * strongest)


def _shortened(text: str, limit: int = 80) -> str:
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 3] + "..."
