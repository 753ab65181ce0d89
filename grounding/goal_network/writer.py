"""Let the goal network write the goal of an instruction."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from safetensors.numpy import load_file

from grounding.goal_network.beam_search import MOST_SAID, Beam, Request, WrittenGoal
from grounding.goal_network.decoder import POSITIONS, GoalDecoder, Instruction, Writings
from grounding.goal_network.vocabulary import KEYWORDS
from grounding.linear_algebra import one_thread
from grounding.packed_weights import unpacked
from grounding.parsers.embedding import WEIGHTS as PARSER_WEIGHTS
from grounding.resolve.attributes import SceneObject
from grounding.untrusted_files import check_weights, read_json

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

WEIGHTS = Path(__file__).parents[1] / "weights" / "goal_network"
UPPER = 3  # layers of the network's own over those of the encoder
_PARSER = PARSER_WEIGHTS / "model.safetensors"  # from which the others are stored as differences
ENCODER_LAYER = 3  # of the six: the lower three stay as they are
TOGETHER = 16  # instructions whose goals are written side by side, so that each weight is read once for all
Network = TypeVar("Network")


class GoalNetworkError(RuntimeError):
    """Weights of the goal network that cannot be used; the message is one sentence that says why."""


class NetworkWriter:
    """The goal network with its encoder.

    Args:
        encoder: the sentence encoder.
        decoder: the network.
    """

    def __init__(self, encoder: SentenceEncoder, decoder: GoalDecoder) -> None:
        self._encoder, self.decoder = encoder, decoder
        self._ahead: dict[tuple[Request, int], list[WrittenGoal]] = {}

    @classmethod
    def from_pretrained(cls, encoder: SentenceEncoder, folder: Path = WEIGHTS) -> NetworkWriter:
        """Load the network of a folder with `config.json` and `model.safetensors`.

        Raises:
            GoalNetworkError: for files that are missing, or that do not fit this version or the encoder.
        """

        def made(config: Mapping[str, Any], state: dict[str, np.ndarray]) -> NetworkWriter:
            if config["keywords"] != list(KEYWORDS):
                raise GoalNetworkError(f"the goal network in {folder} was trained with other keywords")
            return cls(encoder, GoalDecoder(state))

        return load_network("goal network", folder, encoder, made)

    def likeliest(
        self, text: str, count: int, objects: Sequence[SceneObject] | None = None, answers: bool = True
    ) -> list[WrittenGoal]:
        """Write the likeliest goals of an instruction, found by a beam search, the most certain first.

        Args:
            text: the instruction.
            count: of goals at most, and the width of the beam; none for a text that is empty or longer than `MOST_SAID`
                words.
            objects: of the scene; `None` where it is not known.
            answers: whether an answer may be written in place of a goal.
        """
        asked = Request.of(text, objects, answers)
        found = self._ahead.pop((asked, count), None)
        return self._written([asked], count)[0] if found is None else found

    def ahead(self, asked: Iterable[Request], count: int) -> None:
        """Write the goals of many instructions side by side, which takes two thirds of the time, for `likeliest` to
        return; what was written before and nobody asked for is forgotten.
        """
        ordered = sorted(set(asked), key=lambda one: len(one.words))  # little padding
        self._ahead = {}
        for start in range(0, len(ordered), TOGETHER):
            some = ordered[start : start + TOGETHER]
            self._ahead |= zip(((one, count) for one in some), self._written(some, count), strict=True)

    def _written(self, asked: Sequence[Request], count: int) -> list[list[WrittenGoal]]:
        """Write the likeliest goals of each of some instructions."""
        with one_thread():
            instructions = self._instructions(asked)
            beams = [Beam(one, count) for one in asked]
            going = [beam for beam, one in zip(beams, instructions, strict=True) if one is not None]
            writings = Writings(tuple(one for one in instructions if one is not None))
            for _ in range(POSITIONS):
                last = [one.actions[-1] if one.actions else None for beam in going for one in beam.unfinished]
                if not last:
                    break
                writings, scores = self.decoder.scores(writings, last)
                rows = list[int]()
                for beam in going:
                    own = len(beam.unfinished)
                    rows += beam.advance(scores[:own], len(last) - len(scores))
                    scores = scores[own:]
                writings = writings.chosen(rows)
        return [beam.found for beam in beams]

    def _instructions(self, asked: Sequence[Request]) -> list[Instruction | None]:
        """Return what the decoder makes of instructions; `None` for no words, or more than can be read."""
        readable = [number for number, one in enumerate(asked) if one.words and len(one.words) <= MOST_SAID]
        found: list[Instruction | None] = [None] * len(asked)
        if not readable:
            return found
        texts = [asked[number].words for number in readable]
        states = self._encoder.word_states([list(words) for words in texts], ENCODER_LAYER)
        first = [places[: len(words)] for places, words in zip(states.first, texts, strict=True)]
        presence = [asked[number].presence for number in readable]
        begun = self.decoder.begin(states.hidden, states.pieces, first, presence)
        for row, (number, one) in enumerate(zip(readable, begun, strict=True)):
            if states.words[row, : len(texts[row])].all():  # there may be more word pieces than the encoder takes
                found[number] = one
        return found


def load_network(
    name: str,
    folder: Path,
    encoder: SentenceEncoder,
    made: Callable[[Mapping[str, Any], dict[str, np.ndarray]], Network],
) -> Network:
    """Load a network over the lower layers of the sentence encoder: the goal network, or the verifier.

    Args:
        name: of the network, for messages.
        folder: with `config.json` and `model.safetensors`.
        encoder: the sentence encoder.
        made: makes the network of the config and the arrays.

    Raises:
        GoalNetworkError: for files that are missing, or that do not fit this version or the encoder.
    """
    from safetensors import SafetensorError

    try:
        check_weights(folder / "model.safetensors")
        config = read_json(folder / "config.json")
        network = made(config, unpacked(load_file(folder / "model.safetensors"), base_of(config)))
        if config["encoder_sha256"] != encoder.checksum:
            raise GoalNetworkError(f"the {name} in {folder} was trained with another sentence encoder")
        return network
    except (OSError, ValueError, KeyError, TypeError, SafetensorError) as error:
        raise GoalNetworkError(f"the {name} in {folder} cannot be loaded: {error}") from error


def base_of(config: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the arrays from which the stored ones differ, by a network's config; none where all are stored.

    Raises:
        GoalNetworkError: if the parser's weights are others than those that were subtracted.
    """
    record = config.get("difference_to")
    if record is None:
        return {}
    if base_record() != record:
        raise GoalNetworkError(f"the network {record['network']!r} is another than the one that was trained further")
    return base_arrays()


def base_record() -> dict[str, str]:
    """Return what a config says of the network from which its own differs: the parser of the five slots."""
    return {"network": "embedding", "sha256": _parser_sha256()}


@cache
def _parser_sha256() -> str:
    """Return the checksum of the parser's weights, of which two networks are differences."""
    return hashlib.sha256(_PARSER.read_bytes()).hexdigest()


def base_arrays() -> dict[str, np.ndarray]:
    """Return the parser's upper layers, with the names that they have in the goal network and in the verifier."""
    return parser_layers(unpacked(load_file(_PARSER), {}))


def parser_layers(state: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the upper layers of the parser of five slots, with the names that they have in the goal network."""
    layers = 1 + max(int(name.split(".")[1]) for name in state if name.startswith("layers."))
    found = {}
    for name, array in state.items():
        if name.startswith("layers."):
            _, number, rest = name.split(".", 2)
            found[f"upper.{int(number) - (layers - UPPER)}.{rest}"] = array
    return found
