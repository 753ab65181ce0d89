"""Parse sentences to slots from the sentence encoder's word states, with a confidence per slot and the telling words.

A mean over a whole sentence blurs "small cups in a circle" with "cups in a small circle", so the
parser reads the encoder's contextual word states and lets attention pick the telling words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from grounding.linear_algebra import one_thread
from grounding.parse_result import Parse, decide, unreadable
from grounding.parsers.sentence_encoder import EMBEDDING_WIDTH, MAX_TOKENS, SentenceEncoder
from grounding.parsers.spelling import Mended, mend
from grounding.spec import FIRST_SHAPES, SHAPES, SLOTS
from grounding.untrusted_files import check_weights, read_json

if TYPE_CHECKING:
    from grounding.parsers.slot_head import SlotReader

WEIGHTS = Path(__file__).parents[1] / "weights"
# A word is evidence if it carries at least this share of what the strongest word carries.
EVIDENCE_SHARE = 0.3
# Sentences of about one length that the network reads together. Larger batches have more padding, which costs as much
# as words: of 128 sentences in batches of 16, a fifth is padding; in the order in which they come, in batches of 32,
# 43 %.
BATCH = 16
_ARTICLES = ("the", "a", "an", "of")
# No word piece is longer than this; a text beyond is too long, whatever its words.
MAX_CHARACTERS = 20 * MAX_TOKENS


class ParserWeightsError(RuntimeError):
    """Weights of the parser that cannot be used; the message names the file and the reason."""


class EmbeddingParser:
    """A parser that reads instructions by attention over the sentence encoder's word states.

    Args:
        encoder: gives the word states.
        reader: the trained network.
        layer: of the encoder, whose states the reader takes.
        temperatures: question -> what its logits are divided by (Guo et al. 2017).
    """

    name = "embedding"

    def __init__(
        self,
        encoder: SentenceEncoder,
        reader: SlotReader,
        layer: int,
        temperatures: Mapping[str, float],
    ) -> None:
        self.encoder = encoder
        self.reader = reader
        self._layer = layer
        self._temperatures = temperatures
        self._last: tuple[tuple[str, ...], list[Parse]] = ((), [])

    @classmethod
    def from_pretrained(cls, folder: str | Path = WEIGHTS, encoder: SentenceEncoder | None = None) -> EmbeddingParser:
        """Load the trained parser.

        Args:
            folder: of the `config.json` and `model.safetensors` that `grounding.training.embedding_parser` writes.
            encoder: share a loaded one; it must be the one that the parser was trained on.

        Raises:
            ParserWeightsError: for a file that is missing or does not fit, or for another encoder.
        """
        from safetensors import SafetensorError
        from safetensors.numpy import load_file

        from grounding.packed_weights import unpacked
        from grounding.parsers.slot_head import QUESTIONS, SlotReader

        folder = Path(folder)
        for name in ("config.json", "model.safetensors"):
            if not (folder / name).is_file():
                raise ParserWeightsError(f"no parser weights in {folder}: {name} is missing")
        encoder = encoder or SentenceEncoder()
        try:
            check_weights(folder / "model.safetensors")
            config = read_json(folder / "config.json")
            width = config.get("width", EMBEDDING_WIDTH)
            shapes = config.get("shapes", FIRST_SHAPES)
            if unknown := [shape for shape in shapes if shape not in SHAPES]:
                raise ValueError(f"unknown shape {unknown[0]!r}; legal values: {', '.join(SHAPES)}")
            state = unpacked(load_file(folder / "model.safetensors"), {})
            reader = SlotReader(state, config["layers"], width, config["hidden"], shapes)
            layer = int(config["encoder_layer"])
            temperatures = {question: float(config["temperatures"][question]) for question in QUESTIONS}
            checksum = config["encoder_sha256"]
        except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError, SafetensorError) as error:
            reason = " ".join(str(error).split())
            raise ParserWeightsError(f"the parser weights in {folder} do not fit: {reason}") from error
        if encoder.checksum != checksum:
            raise ParserWeightsError(
                f"the parser in {folder} was trained on the encoder {checksum[:12]}..., not on "
                f"{encoder.checksum[:12]}... of {encoder.folder}"
            )
        return cls(encoder, reader, layer, temperatures)

    def parse(self, text: str) -> Parse:
        """Parse one instruction; see `Parse.status` for whether it can be built."""
        return self.parse_batch([text])[0]

    def parse_batch(self, texts: Sequence[str]) -> list[Parse]:
        """Parse each of many instructions, much faster than one by one.

        The last texts are not parsed again: a conversation reads a text after each goal that it may speak of.
        """
        last, parses = self._last
        if last != tuple(texts):
            parses = self._parsed(texts)
            self._last = tuple(texts), parses
        return list(parses)

    def _parsed(self, texts: Sequence[str]) -> list[Parse]:
        found: dict[int, Parse] = {}
        readable = []
        for place, text in enumerate(map(_sound, texts)):
            why = _why_unreadable(text)
            if why:
                found[place] = unreadable(text, why, self.name)
            else:
                readable.append((place, text, mend(text, self.encoder.whole_words)))
        overflowing = self.encoder.overflowing([mended.text for _, _, mended in readable])
        for (place, text, _), too_long in zip(readable, overflowing, strict=True):
            if too_long:  # known before the network runs: texts of the greatest length would cost it most
                found[place] = unreadable(text, _too_long(text), self.name)
        readable = [entry for entry, too_long in zip(readable, overflowing, strict=True) if not too_long]
        readable.sort(key=lambda entry: len(entry[2].text))  # little padding per batch
        for start in range(0, len(readable), BATCH):
            chosen = readable[start : start + BATCH]
            parses = self._parse([text for _, text, _ in chosen], [mended for *_, mended in chosen])
            found.update(zip((place for place, *_ in chosen), parses, strict=True))
        return [found[place] for place in range(len(texts))]

    def _parse(self, texts: Sequence[str], mended: Sequence[Mended]) -> list[Parse]:
        from grounding.parsers.bert import softmax
        from grounding.parsers.slot_head import QUESTIONS, REFUSE

        states = self.encoder.token_states([text.text for text in mended], self._layer)
        with one_thread():
            votes = dict(zip(QUESTIONS, self.reader(states.hidden, states.mask), strict=True))
        shares = {
            question: softmax(vote.sum(axis=1) / np.float32(self._temperatures[question]), axis=-1).tolist()
            for question, vote in votes.items()
        }
        parses = []
        for row, text in enumerate(texts):
            probabilities = {
                question: dict(zip(self.reader.answers[question], shares[question][row], strict=True))
                for question in QUESTIONS
            }
            refusals = {reason: share for reason, share in probabilities.pop(REFUSE).items() if reason is not None}
            words = _words_of_pieces(mended[row], states.spans[row])
            evidence = {slot: _telling_words(text, words, self._added(votes[slot][row])) for slot in SLOTS}
            parses.append(decide(text, probabilities, evidence, refusals, self.name))
        return parses

    @staticmethod
    def _added(vote: np.ndarray) -> list[float]:
        """Return how much each word piece adds to the slot's best value, compared with leaving it open."""
        best = int(vote.sum(axis=0)[:-1].argmax())
        return (vote[:, best] - vote[:, -1]).tolist()


def _sound(text: str) -> str:
    """Return the text in valid UTF-8: lone surrogates, as in broken input, become replacement marks."""
    return text.encode("utf-8", "replace").decode()


def _why_unreadable(text: str) -> str:
    if not any(letter.isalnum() for letter in text):
        said = "is empty" if not text.strip() else "has no words"
        return f"the instruction {said}; say what to build, for example 'a small circle on the left'"
    return _too_long(text) if len(text) > MAX_CHARACTERS else ""


def _too_long(text: str) -> str:
    return (
        f"the instruction is too long: {len(text)} characters are more than the {MAX_TOKENS} word pieces "
        "(about 180 words) that can be read; say it more briefly"
    )


def _words_of_pieces(mended: Mended, spans: Sequence[tuple[int, int]]) -> list[tuple[int, int] | None]:
    """Return the word of the original text that each word piece belongs to, (first, last); `None` for marks and
    padding.
    """
    return [mended.original_span(first, last) if last > first else None for first, last in spans]


def _telling_words(text: str, pieces: Sequence[tuple[int, int] | None], added: Sequence[float]) -> tuple[str, ...]:
    """Return the words of the text that add most, in the order of the text."""
    words: dict[tuple[int, int], float] = {}
    for span, amount in zip(pieces, added, strict=False):
        if span is not None:
            words[span] = words.get(span, 0.0) + amount
    strongest = max(words.values(), default=0.0)
    if strongest <= 0.0:
        return ()
    telling = [text[slice(*span)] for span, amount in words.items() if amount >= EVIDENCE_SHARE * strongest]
    # Articles carry some of their noun's weight, and tell a reader nothing.
    return tuple(word for word in telling if word.lower() not in _ARTICLES) or tuple(telling)
