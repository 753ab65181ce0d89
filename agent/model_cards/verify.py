"""Verify that a network matches its card and works: checksums, config, weights, and one pass on synthetic input."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from agent.errors import BadInput, one_sentence
from agent.model_cards.card import RECORD, files_of
from agent.model_cards.card_text import checked_facts
from agent.model_cards.catalogue import CONFIG, Network

if TYPE_CHECKING:
    import torch

    from grounding.verify.verifier import Verifier
    from structdiffusion.models.checkpoint import Checkpointed

_BATCH, _OBJECTS, _WORDS = 2, 5, 7  # of the fake inputs
_PICTURE = (48, 64)  # pixels
_SENTENCE = "a small circle on the left"


class _Wrong(Exception):
    """A failed check; the message says what was found."""


@dataclass(frozen=True)
class Finding:
    """The result of one check of a network.

    Attributes:
        name: the name of the network.
        check: "files", "weights" or "answer".
        passed: whether the check passed.
        detail: what was found, in a few words.
    """

    name: str
    check: str
    passed: bool
    detail: str


def verify(network: Network) -> Iterator[Finding]:
    """Run the checks of a network in order; later checks run even after a failure."""
    weights, answer = _OTHERS.get(network.family, (_checkpoint, _answer))
    checks = {"files": _files, "weights": weights, "answer": answer}
    for name, check in checks.items():
        try:
            yield Finding(network.name, name, True, check(network))
        except _known_errors() as error:
            yield Finding(network.name, name, False, one_sentence(error))


def _known_errors() -> tuple[type[Exception], ...]:
    from grounding.goal_network.writer import GoalNetworkError
    from grounding.parsers.embedding import ParserWeightsError
    from grounding.parsers.llm_reply import LLMError
    from grounding.parsers.sentence_encoder import EncoderError
    from structdiffusion.models.checkpoint import CheckpointError

    return _Wrong, BadInput, OSError, CheckpointError, ParserWeightsError, GoalNetworkError, EncoderError, LLMError


def _files(network: Network) -> str:
    on_card, found = checked_facts(network)["files"], files_of(network)
    if not on_card:
        raise _Wrong(f"no checksum is written: {network.folder} has neither {network.facts_path.name} nor {RECORD}")
    for name, about in found.items():
        if about != on_card.get(name):
            raise _Wrong(f"{network.folder / name} differs from its model card: the checksums differ")
    return f"{len(found)} as on the card"


def _checkpoint(network: Network) -> str:
    from structdiffusion.models.checkpoint import ADDED_KEYS

    model = _loaded(network)
    config = json.loads((network.folder / CONFIG).read_text())
    missing = sorted(asdict(model.config).keys() - config.keys() - ADDED_KEYS.keys())
    if missing:
        raise _Wrong(f"{network.folder / CONFIG} lacks {missing[0]!r}")
    return _finite(model.state_dict(), network)


def _answer(network: Network) -> str:
    import torch

    model: Any = _loaded(network)
    generator = torch.Generator().manual_seed(0)
    given = model.fake_input(_BATCH, _OBJECTS, generator)
    answer, shape = model.try_out(given, generator), model.answer_shape(given)
    return _sound(answer, shape)


def _loaded(network: Network) -> Checkpointed:
    from structdiffusion.models.collision import CollisionDiscriminator
    from structdiffusion.models.cvae import PoseCVAE
    from structdiffusion.models.diffusion import PoseDiffusion
    from structdiffusion.models.outcome import OutcomeDiscriminator
    from structdiffusion.models.strokes.model import StrokeNetwork
    from structdiffusion.models.structformer import StructFormer
    from structdiffusion.models.structure import StructureDiscriminator

    judges = (StructureDiscriminator, CollisionDiscriminator, OutcomeDiscriminator)
    return {kind.kind: kind for kind in (PoseDiffusion, PoseCVAE, StructFormer, *judges, StrokeNetwork)}[
        network.family
    ].from_pretrained(network.folder)


def _parser(network: Network) -> str:
    import torch

    from grounding.parsers.embedding import EmbeddingParser

    state = EmbeddingParser.from_pretrained(network.folder).reader.state
    return _finite({name: torch.from_numpy(array) for name, array in state.items()}, network)


def _parser_answer(network: Network) -> str:
    """Compute the votes of word states (B, T, 384) of unit variance; the last state of the first sentence is
    padding.
    """
    import torch

    from grounding.parsers.embedding import EmbeddingParser
    from grounding.parsers.slot_head import QUESTIONS

    reader, generator = EmbeddingParser.from_pretrained(network.folder).reader, torch.Generator().manual_seed(0)
    mask = torch.ones(_BATCH, _WORDS, dtype=torch.bool)
    mask[0, -1] = False
    votes = reader(torch.randn(_BATCH, _WORDS, 384, generator=generator).numpy(), mask.numpy())
    for question, vote in zip(QUESTIONS, votes, strict=True):
        _sound(torch.from_numpy(vote), (_BATCH, _WORDS, len(reader.answers[question])))
    return f"{len(votes)} questions"


def _goal_network(network: Network) -> str:
    import torch

    from grounding.goal_network.writer import NetworkWriter
    from grounding.parsers.sentence_encoder import SentenceEncoder

    state = NetworkWriter.from_pretrained(SentenceEncoder(), network.folder).decoder.state
    return _finite({name: torch.from_numpy(array) for name, array in state.items()}, network)


def _goal_network_answer(network: Network) -> str:
    """Compute the scores of the first action of an instruction."""
    import torch

    from grounding.goal_network.decoder import Writings
    from grounding.goal_network.vocabulary import KEYWORDS
    from grounding.goal_network.word_presence import word_presence
    from grounding.goal_network.writer import ENCODER_LAYER, NetworkWriter
    from grounding.parsers.sentence_encoder import SentenceEncoder

    encoder, words = SentenceEncoder(), ["stack", "the", "cans"]
    decoder = NetworkWriter.from_pretrained(encoder, network.folder).decoder
    states = encoder.word_states([words], ENCODER_LAYER)
    begun = decoder.begin(states.hidden, states.pieces, list(states.first), [word_presence(words, None)])
    _, scores = decoder.scores(Writings(tuple(begun)), [None])
    return _sound(torch.from_numpy(scores[0]), (len(KEYWORDS) + 2 * len(words),))


def _verifier(network: Network) -> str:
    import torch

    state = _loaded_verifier(network).state
    return _finite({name: torch.from_numpy(array) for name, array in state.items()}, network)


def _verifier_answer(network: Network) -> str:
    """Judge the goal of one sentence, and compute its probability."""
    import torch

    from grounding.decide import Candidate, decide
    from grounding.goals.goal import Goal
    from grounding.goals.parts import StructurePart
    from grounding.propose.proposal import Proposal
    from grounding.verify.verifier import pair_of

    verifier, goal = _loaded_verifier(network), Goal((StructurePart("circle", "small", "left"),))
    pair = pair_of(_SENTENCE, goal, ())
    (judged,) = verifier.judge([pair])
    probabilities = []
    for kind, weights in verifier.weights.items():
        try:
            decision = decide([Candidate(Proposal(goal, 0.5), judged.logit)], (), weights)
        except ValueError as error:
            raise _Wrong(
                f"{network.folder / CONFIG} has {len(weights)} weights of the probability of {kind!r}: {error}"
            ) from error
        probabilities.append(decision.probability)
    _sound(torch.tensor([judged.logit, *probabilities]), (3,))
    return _sound(torch.from_numpy(judged.lost), (pair.end - pair.first,))


def _loaded_verifier(network: Network) -> Verifier:
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from grounding.verify.verifier import Verifier

    return Verifier.from_pretrained(SentenceEncoder(), network.folder)


def _segmentation(network: Network) -> str:
    import torch

    from agent.segmentation_network.network import SegmentationNetwork

    state = SegmentationNetwork.from_pretrained(network.folder).state
    return _finite({name: torch.from_numpy(array) for name, array in state.items()}, network)


def _segmentation_answer(network: Network) -> str:
    """Compute what the network says of a picture of unit variance."""
    import numpy as np
    import torch

    from agent.segmentation_network.features import CHANNELS
    from agent.segmentation_network.network import OUTPUTS, SegmentationNetwork

    maps = np.random.default_rng(0).normal(size=(CHANNELS, *_PICTURE)).astype(np.float32)
    answer = SegmentationNetwork.from_pretrained(network.folder).outputs(maps)
    return _sound(torch.from_numpy(answer), (OUTPUTS, *_PICTURE))


def _adapter(network: Network) -> str:
    from grounding.parsers.llm_local import read_adapter

    matrices = read_adapter(network.folder / network.files[-1]).matrices
    for name, (a, b) in matrices.items():
        if a.ndim != 2 or b.ndim != 2 or len(a) != b.shape[1]:
            raise _Wrong(f"{name} has shapes {tuple(a.shape)} and {tuple(b.shape)}, which do not multiply")
    return _finite({f"{name}.{i}": part for name, parts in matrices.items() for i, part in enumerate(parts)}, network)


def _adapter_answer(network: Network) -> str:
    """Compute the answers to one sentence after the prompt; this needs the language model itself."""
    import math

    from grounding.parsers.llm import PROMPT
    from grounding.parsers.llm_local import LocalLLM
    from grounding.parsers.llm_reply import ANSWERS
    from prompts import load_prompt

    reply: Any = LocalLLM(adapter=network.folder / network.files[-1]).ask(load_prompt(PROMPT), _SENTENCE)
    for question, answers in ANSWERS.items():
        shares = reply[question]
        if set(shares) != set(answers) or not math.isclose(sum(shares.values()), 1.0, abs_tol=1e-6):
            raise _Wrong(f"its answers to {question!r} are not probabilities: {shares}")
    return f"{len(reply)} questions"


def _finite(weights: dict[str, torch.Tensor], network: Network) -> str:
    for name, tensor in weights.items():
        if tensor.is_floating_point() and not bool(tensor.isfinite().all()):
            raise _Wrong(f"{network.folder / network.files[-1]}: {name!r} has numbers that are not finite")
    return f"{len(weights)} tensors, finite"


def _sound(answer: torch.Tensor, shape: tuple[int, ...]) -> str:
    if tuple(answer.shape) != tuple(shape):
        raise _Wrong(f"its answer to a fake input has shape {tuple(answer.shape)}; documented: {tuple(shape)}")
    if not bool(answer.isfinite().all()):
        raise _Wrong("its answer to a fake input is not finite")
    return f"{tuple(shape)}, finite"


# How the networks that run in numpy, or in a language model, are checked; the others have a checkpoint.
_OTHERS = {
    "embedding": (_parser, _parser_answer),
    "goals": (_goal_network, _goal_network_answer),
    "verifier": (_verifier, _verifier_answer),
    "llm": (_adapter, _adapter_answer),
    "segmentation": (_segmentation, _segmentation_answer),
}
