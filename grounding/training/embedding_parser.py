"""Train the embedding parser (`structagent train parser`): about 35 minutes on one core.

Every sentence is drawn anew from the training language and seen once; a tenth are sentences of the
grammar, less its held-out splits. The temperatures, which make the confidences honest, come from the
development sentences, which people wrote by hand and no weight has seen. The weights that come with
the project are of three runs, the later ones with `--start` and `--rate`; `config.json` has the last.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.torch import save
from torch import nn
from torch.nn import functional

from grounding.atomic_files import write_all_whole
from grounding.benchmark import Row, development_rows, score
from grounding.corpus.grammar import all_sentences, split_of
from grounding.corpus.paraphrases import LabelledText, paraphrase
from grounding.parsers.embedding import WEIGHTS, EmbeddingParser
from grounding.parsers.named_encoder import NamedEncoder
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.parsers.slot_head import ANSWERS, QUESTIONS, REFUSE, SlotReader
from grounding.parsers.spelling import mend
from grounding.spec import FIRST_SHAPES, SLOTS
from grounding.training.precision import quick_steps
from grounding.training.slot_network import SlotNetwork

# The encoder has six layers. Its lowest two stay as they are and the others learn: with all six frozen,
# heads on their states read a tenth fewer of the development sentences without a mistake.
ENCODER_LAYER = 2
HIDDEN = 64
BATCH = 32
SENTENCES = 144_000
LEARNING_RATE = 1e-4
HEAD_LEARNING_RATE = 2e-3
CORPUS_SHARE = 0.1
# Sentences of like length share a batch, chosen among this many batches: little padding, still mixed.
BUCKET = 20


@dataclass(frozen=True)
class ParserTraining:
    """How to train the embedding parser.

    Attributes:
        out: folder for `model.safetensors` and `config.json`.
        seed: of the sentences, the initial weights and dropout.
        sentences: how many are drawn and read, each once.
        threads: of torch; only one repeats exactly.
        start: folder of weights to continue from; `None` starts from the encoder's own layers.
        rate: factor of the learning rates.

    Raises:
        ValueError: for fewer sentences than one batch, no thread, or a rate that is not positive.
    """

    out: Path = WEIGHTS
    seed: int = 0
    sentences: int = SENTENCES
    threads: int = 1
    start: Path | None = None
    rate: float = 1.0

    def __post_init__(self) -> None:
        if self.sentences < BATCH:
            raise ValueError(f"sentences must be at least {BATCH} (one batch), not {self.sentences}")
        if self.threads < 1:
            raise ValueError(f"threads must be at least 1, not {self.threads}")
        if not self.rate > 0.0:
            raise ValueError(f"rate must be positive, not {self.rate}")


def train(options: ParserTraining, report: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """Train, calibrate, measure and write a parser: `model.safetensors` (float16) and `config.json`.

    Args:
        options: what to train, and where to write it.
        report: takes a line of progress after every hundred batches.

    Returns:
        What `config.json` holds; "development" has the rates on the development sentences.

    Raises:
        EncoderError, ParserWeightsError: for an encoder, or weights to start from, that cannot be used.
    """
    torch.set_num_threads(options.threads)
    encoder = SentenceEncoder()
    start = EmbeddingParser.from_pretrained(options.start, encoder).reader if options.start else None
    network = fit_network(encoder, options.sentences, options.seed, start, options.rate, report)
    reader = network.reader()
    rows = development_rows()
    temperatures = calibrate(reader, encoder, rows)
    parser = EmbeddingParser(encoder, reader, ENCODER_LAYER, temperatures)
    found = score(rows, parser.parse_batch([row.text for row in rows]))
    before = json.loads((options.start / "config.json").read_text())["sentences"] if options.start else 0
    config = {
        "encoder_layer": ENCODER_LAYER,
        "layers": reader.layers,
        "hidden": HIDDEN,
        "shapes": list(FIRST_SHAPES),
        "temperatures": temperatures,
        "encoder_sha256": encoder.checksum,
        "seed": options.seed,
        "sentences": options.sentences,
        "before": before,
        "development": {name: found[name] for name in ("exact", "slots", "false_fills", "refusal", "strata")},
    }
    weights = save({name: tensor.half() for name, tensor in network.state_dict().items()})
    write_all_whole(options.out, {"model.safetensors": weights, "config.json": json.dumps(config, indent=2) + "\n"})
    return config


def draw_sentences(count: int, rng: np.random.Generator) -> Iterator[LabelledText]:
    """Draw labelled training sentences."""
    grammar = [(text, spec) for text, spec in all_sentences() if split_of(text) == "seen"]
    for _ in range(count):
        if rng.random() < CORPUS_SHARE:
            text, spec = grammar[rng.integers(len(grammar))]
            yield LabelledText(text, spec.to_dict())
        else:
            yield paraphrase(rng)


def batches(sentences: Sequence[LabelledText], rng: np.random.Generator) -> Iterator[list[LabelledText]]:
    """Group the sentences into batches of like length, in random order."""
    for start in range(0, len(sentences), BATCH * BUCKET):
        chunk = sorted(sentences[start : start + BATCH * BUCKET], key=lambda sentence: len(sentence.text))
        starts = list(range(0, len(chunk), BATCH))
        for k in rng.permutation(starts):
            yield chunk[k : k + BATCH]


def loss_of(network: SlotNetwork, encoder: SentenceEncoder, batch: Sequence[LabelledText]) -> torch.Tensor:
    """Sum the questions' cross-entropies; the slots of what must be refused do not count."""
    states = encoder.token_states(
        [mend(entry.text, encoder.whole_words).text for entry in batch], ENCODER_LAYER
    )
    with quick_steps():
        votes = network(torch.from_numpy(states.hidden), torch.from_numpy(states.mask))
    return loss_of_votes(votes, batch)


def loss_of_votes(votes: Sequence[torch.Tensor], batch: Sequence[LabelledText]) -> torch.Tensor:
    """Sum the questions' cross-entropies, from what each word piece adds to each answer (B, T, answers)."""
    logits = [vote.float().sum(dim=1) for vote in votes]  # (B, answers) each
    answers = torch.tensor(
        [[*(ANSWERS[slot].index(entry.labels[slot]) for slot in SLOTS), ANSWERS[REFUSE].index(entry.refuse)]
         for entry in batch]
    )  # (B, questions)  # fmt: skip
    built = answers[:, -1] == len(ANSWERS[REFUSE]) - 1
    loss = functional.cross_entropy(logits[-1], answers[:, -1])
    if built.any():
        loss = loss + sum(
            functional.cross_entropy(logits[i][built], answers[built, i]) for i in range(len(SLOTS))
        )
    return loss


def fit_network(
    encoder: SentenceEncoder,
    sentences: int,
    seed: int,
    start: SlotReader | None = None,
    rate: float = 1.0,
    report: Callable[[str], None] = lambda line: None,
) -> SlotNetwork:
    """Fit the parser's network to that many sentences.

    Args:
        encoder: gives the word states.
        sentences: how many are drawn.
        seed: the random seed.
        start: continues with this one; `None` starts from the encoder's own layers.
        rate: factor of the learning rates.
        report: takes a line of progress after every hundred batches.
    """
    rng = np.random.default_rng(seed)
    with torch.random.fork_rng():
        torch.manual_seed(seed)  # initial weights and dropout know no generator of their own
        network = _initial_network(encoder) if start is None else SlotNetwork.of(start)
        steps = sentences // BATCH
        optimiser, schedule = _optimiser(network, steps, rate)
        started, recent = time.perf_counter(), []
        drawn = list(draw_sentences(steps * BATCH, rng))
        for step, batch in enumerate(batches(drawn, rng), start=1):
            loss = loss_of(network.train(), encoder, batch)
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            recent.append(loss.item())
            if step % 100 == 0:
                seconds = time.perf_counter() - started
                report(f"step {step} of {steps}, loss {np.mean(recent[-100:]):.3f}, {seconds:.0f} s")
    return network.eval()


def _initial_network(encoder: SentenceEncoder) -> SlotNetwork:
    """Return a network whose transformer layers are copies of the encoder's upper ones."""
    upper_layers = encoder.network().layers[ENCODER_LAYER:]
    network = SlotNetwork(layers=len(upper_layers), hidden=HIDDEN)
    for own, layer in zip(network.layers, upper_layers, strict=True):
        own.load_state_dict({name: torch.from_numpy(array) for name, array in layer.state().items()})
    return network


def _optimiser(
    network: SlotNetwork, steps: int, rate: float
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    """Return AdamW with one learning rate for the layers and one for the heads, and its one-cycle schedule."""
    upper = list(network.layers.parameters())
    heads = [weight for name, weight in network.named_parameters() if not name.startswith("layers.")]
    rates = [rate * LEARNING_RATE, rate * HEAD_LEARNING_RATE]
    optimiser = torch.optim.AdamW(
        [{"params": upper, "lr": rates[0]}, {"params": heads, "lr": rates[1]}], weight_decay=0.01
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, rates, total_steps=steps + 1, pct_start=0.1)
    return optimiser, schedule


def calibrate(
    reader: SlotReader,
    encoder: SentenceEncoder | NamedEncoder,
    rows: Sequence[Row],
    layer: int | None = ENCODER_LAYER,
) -> dict[str, float]:
    """Find each question's temperature: the least negative log-likelihood of the acceptable answers, by grid search."""
    logits: dict[str, list[torch.Tensor]] = {question: [] for question in QUESTIONS}
    for row in rows:
        states = encoder.token_states([mend(row.text, encoder.whole_words).text], layer)
        for question, vote in zip(QUESTIONS, reader(states.hidden, states.mask), strict=True):
            logits[question].append(torch.from_numpy(vote[0].sum(axis=0)))
    return {question: _temperature(question, logits[question], rows) for question in QUESTIONS}


def _temperature(question: str, logits: Sequence[torch.Tensor], rows: Sequence[Row]) -> float:
    def cost(temperature: float) -> float:
        total = 0.0
        for row, logit in zip(rows, logits, strict=True):
            shares = (logit / temperature).softmax(dim=-1)
            if question == REFUSE:
                right = [i for i, answer in enumerate(ANSWERS[REFUSE]) if (answer is not None) == row.refuse]
            elif row.refuse:
                continue
            else:
                right = [
                    i for i, answer in enumerate(ANSWERS[question]) if answer in row.acceptable[question]
                ]
            total -= float(shares[right].sum().clamp_min(1e-6).log())
        return total

    return float(min(np.geomspace(0.25, 8.0, 61), key=cost))
