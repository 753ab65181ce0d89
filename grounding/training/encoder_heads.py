"""Fit a parser's heads once to a sentence encoder that a user names, and keep them in the cache.

The shipped parser continues all-MiniLM-L6-v2's own layers, which no other encoder has. On another encoder the same
heads are fitted to the last layer's states, which stay as they are: minutes in place of half an hour, and more
mistakes. How many is measured on the development sentences after each fit, kept with the weights and reported at each
use.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

from grounding.atomic_files import unfinished_folder
from grounding.benchmark import development_rows
from grounding.corpus.paraphrases import LabelledText
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.llm_model import cache_folder
from grounding.parsers.named_encoder import NamedEncoder
from grounding.parsers.spelling import mend
from grounding.training.embedding_parser import CORPUS_SHARE, loss_of_votes, measure
from grounding.training.slot_network import SlotNetwork
from grounding.training.slot_texts import draw_sentences
from grounding.training.steps import Report, by_length, one_cycle, silent, take_steps

VERSION = 1  # of the fit: a parser of another version in the cache is not used
SENTENCES, EPOCHS, BATCH = 8000, 10, 32
HIDDEN = 64
LEARNING_RATE = 2e-3
REPORT_EVERY = 50  # batches of encoded sentences

# One batch: its labels, the encoder's states (B, T, width) float16 and where they are of the text (B, T) bool.
_Batch = tuple[Sequence[LabelledText], torch.Tensor, torch.Tensor]


def parser_on(
    encoder: NamedEncoder, folder: Path | None = None, report: Report = silent, sentences: int = SENTENCES
) -> EmbeddingParser:
    """Load the parser on a named encoder; if it is not in the cache, fit it first.

    Args:
        encoder: gives the states.
        folder: of the fitted parsers; by default in the user's cache.
        report: receives a line when fitting starts, and one with the accuracy of the fitted parser.
        sentences: how many it is fitted to.

    Raises:
        ParserWeightsError: for files in the cache that do not fit; the message names them.
        OSError: if the cache cannot be written.
    """
    folder = (folder or cache_folder() / "parsers") / f"{encoder.checksum[:16]}-{VERSION}-{sentences}"
    if not (folder / "config.json").is_file():
        _fit(encoder, folder, report, sentences)
    exact = json.loads((folder / "config.json").read_text())["development"]["exact"]
    report(
        f"the parser on the sentence encoder {encoder.source!r} parses {exact['hits']} of {exact['n']} development "
        f"sentences without a mistake ({100 * exact['rate']:.1f} %)"
    )
    return EmbeddingParser.from_pretrained(folder, encoder)


def _fit(encoder: NamedEncoder, folder: Path, report: Report, sentences: int) -> None:
    """Fit, calibrate and measure heads, and write the folder, all of it or nothing."""
    report(f"fitting a parser to the sentence encoder {encoder.source!r}: {sentences} sentences, once")
    batches = list(_encoded(encoder, sentences, report))
    network = _trained(batches, encoder.state_width)
    name = f"embedding on {Path(encoder.source).name}"
    config = {
        "name": name, "encoder_layer": None, "layers": 0, "width": encoder.state_width, "hidden": HIDDEN,
        "encoder": encoder.source, "encoder_sha256": encoder.checksum, "sentences": sentences,
        **measure(network.reader(), encoder, development_rows(), None, name),
    }  # fmt: skip
    with unfinished_folder(folder) as unfinished:
        save_file(network.state_dict(), unfinished / "model.safetensors")
        (unfinished / "config.json").write_text(json.dumps(config, indent=2) + "\n")
        if not folder.exists():  # else another process was quicker
            unfinished.rename(folder)


def _encoded(encoder: NamedEncoder, count: int, report: Report) -> Iterator[_Batch]:
    """Draw the training sentences and encode each once, in batches of like length."""
    rng = np.random.default_rng(0)
    drawn = islice(draw_sentences(rng, CORPUS_SHARE), count)
    for number, batch in enumerate(by_length(drawn, BATCH, count, lambda entry: len(entry.text), rng), start=1):
        states = encoder.token_states([mend(entry.text, encoder.whole_words).text for entry in batch])
        yield batch, torch.from_numpy(states.hidden).half(), torch.from_numpy(states.mask)
        if number % REPORT_EVERY == 0:
            report(f"{number * BATCH} of {count} sentences encoded")


def _trained(batches: Sequence[_Batch], width: int) -> SlotNetwork:
    """Train heads that have seen every sentence `EPOCHS` times."""
    rng, steps = np.random.default_rng(0), EPOCHS * len(batches)
    with torch.random.fork_rng():
        torch.manual_seed(0)  # initial weights and dropout know no generator of their own
        network = SlotNetwork(layers=0, width=width, hidden=HIDDEN).train()
        drawn = (batches[k] for _ in range(EPOCHS) for k in rng.permutation(len(batches)))
        losses = (loss_of_votes(network(hidden.float(), mask), labels) for labels, hidden, mask in drawn)
        for _ in take_steps(losses, steps, *one_cycle([(network.parameters(), LEARNING_RATE)], steps), silent):
            pass
    return network.eval()
