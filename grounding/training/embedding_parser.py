"""Train the embedding parser (`structagent train parser`): about 35 minutes on one core.

Every sentence is drawn anew from the training language and seen once; a tenth are sentences of the
grammar, less its held-out splits. The temperatures, which make the confidences honest, come from the
development sentences, which people wrote by hand and no weight has seen. The weights that come with
the project are of three runs, the later ones with `--start` and `--rate`; `config.json` has the last.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch.nn import functional

from grounding.atomic_files import write_all_whole
from grounding.benchmark import Row, development_rows, score
from grounding.corpus.paraphrases import LabelledText
from grounding.packed_weights import packed_bytes
from grounding.parsers.embedding import WEIGHTS, EmbeddingParser
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.parsers.slot_head import ANSWERS, QUESTIONS, REFUSE, SlotReader
from grounding.parsers.spelling import mend
from grounding.spec import FIRST_SHAPES, SLOTS
from grounding.training.precision import quick_steps
from grounding.training.slot_network import SlotNetwork
from grounding.training.slot_texts import draw_sentences, temperature
from grounding.training.steps import Report, Training, by_length, one_cycle, silent, split_weights, take_steps

# The encoder has six layers. Its lowest two stay as they are and the others learn: with all six frozen,
# heads on their states read a tenth fewer of the development sentences without a mistake.
ENCODER_LAYER = 2
HIDDEN = 64
BATCH, BUCKET = 32, 20
SENTENCES = 144_000
LEARNING_RATE = 1e-4
HEAD_LEARNING_RATE = 2e-3
CORPUS_SHARE = 0.1


@dataclass(frozen=True)
class ParserTraining(Training):
    """How to train the embedding parser, on batches of `BATCH` sentences; `rate` is a factor of the learning rates.

    Without a start it begins with the encoder's own layers.
    """

    out: Path = WEIGHTS
    steps: int = SENTENCES // BATCH
    rate: float = 1.0


def train(options: ParserTraining, report: Report = silent) -> dict[str, Any]:
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
    network = _trained(options, encoder, report)
    reader = network.reader()
    measured = measure(reader, encoder, development_rows())
    before = json.loads((options.start / "config.json").read_text())["sentences"] if options.start else 0
    config = {
        "encoder_layer": ENCODER_LAYER,
        "layers": reader.layers,
        "hidden": HIDDEN,
        "shapes": list(FIRST_SHAPES),
        "encoder_sha256": encoder.checksum,
        "seed": options.seed,
        "sentences": options.steps * BATCH,
        "before": before,
        **measured,
    }
    weights = packed_bytes({name: tensor.numpy() for name, tensor in network.state_dict().items()}, {})
    write_all_whole(options.out, {"model.safetensors": weights, "config.json": json.dumps(config, indent=2) + "\n"})
    return config


def loss_of(network: SlotNetwork, encoder: SentenceEncoder, batch: Sequence[LabelledText]) -> torch.Tensor:
    """Sum the questions' cross-entropies; the slots of what must be refused do not count."""
    states = encoder.token_states([mend(entry.text, encoder.whole_words).text for entry in batch], ENCODER_LAYER)
    with quick_steps():
        votes = network(torch.from_numpy(states.hidden), torch.from_numpy(states.mask))
    logits = [vote.float().sum(dim=1) for vote in votes]  # (B, answers) each
    answers = torch.tensor(
        [[*(ANSWERS[slot].index(entry.labels[slot]) for slot in SLOTS), ANSWERS[REFUSE].index(entry.refuse)]
         for entry in batch]
    )  # (B, questions)  # fmt: skip
    built = answers[:, -1] == len(ANSWERS[REFUSE]) - 1
    loss = functional.cross_entropy(logits[-1], answers[:, -1])
    if built.any():
        loss = loss + sum(functional.cross_entropy(logits[i][built], answers[built, i]) for i in range(len(SLOTS)))
    return loss


def _trained(options: ParserTraining, encoder: SentenceEncoder, report: Report) -> SlotNetwork:
    """Train the parser's network."""
    rng = np.random.default_rng(options.seed)
    with torch.random.fork_rng():
        torch.manual_seed(options.seed)  # initial weights and dropout know no generator of their own
        if options.start is None:
            network = _initial_network(encoder)
        else:
            network = SlotNetwork.of(EmbeddingParser.from_pretrained(options.start, encoder).reader)
        batches = by_length(draw_sentences(rng, CORPUS_SHARE), BATCH, BUCKET, lambda entry: len(entry.text), rng)
        losses = (loss_of(network.train(), encoder, batch) for batch in batches)
        layers, heads = split_weights(network, "layers.")
        groups = ((layers, options.rate * LEARNING_RATE), (heads, options.rate * HEAD_LEARNING_RATE))
        for _ in take_steps(losses, options.steps, *one_cycle(groups, options.steps), report):
            pass
    return network.eval()


def _initial_network(encoder: SentenceEncoder) -> SlotNetwork:
    """Return a network whose transformer layers are copies of the encoder's upper ones."""
    upper_layers = encoder.network().layers[ENCODER_LAYER:]
    network = SlotNetwork(layers=len(upper_layers), hidden=HIDDEN)
    for own, layer in zip(network.layers, upper_layers, strict=True):
        own.load_state_dict({name: torch.from_numpy(array) for name, array in layer.state().items()})
    return network


def measure(reader: SlotReader, encoder: SentenceEncoder, rows: Sequence[Row]) -> dict[str, Any]:
    """Return a network's "temperatures", and its rates on "development" sentences."""
    temperatures = calibrate(reader, encoder, rows)
    parser = EmbeddingParser(encoder, reader, ENCODER_LAYER, temperatures)
    found = score(rows, parser.parse_batch([row.text for row in rows]))
    rates = ("exact", "slots", "false_fills", "refusal", "strata")
    return {"temperatures": temperatures, "development": {rate: found[rate] for rate in rates}}


def calibrate(reader: SlotReader, encoder: SentenceEncoder, rows: Sequence[Row]) -> dict[str, float]:
    """Find each question's temperature: that at which the acceptable answers are the likeliest."""
    said = (encoder.token_states([mend(row.text, encoder.whole_words).text], ENCODER_LAYER) for row in rows)
    votes = [reader(states.hidden, states.mask) for states in said]
    found = {}
    for number, question in enumerate(QUESTIONS):
        # Of what is refused no slot is known.
        asked = [place for place, row in enumerate(rows) if question == REFUSE or not row.refuse]
        logits = np.array([votes[place][number][0].sum(axis=0) for place in asked], dtype=np.float64)
        right = np.array([[_is_right(rows[place], question, one) for one in ANSWERS[question]] for place in asked])
        found[question] = temperature(logits, right)
    return found


def _is_right(row: Row, question: str, answer: str | None) -> bool:
    return (answer is not None) == row.refuse if question == REFUSE else answer in row.acceptable[question]
