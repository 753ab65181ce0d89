"""Fit a parser's heads once to a sentence encoder that a user names, and keep them in the cache.

The shipped parser continues all-MiniLM-L6-v2's own layers, which no other encoder has. On another encoder the same
heads are fitted to the last layer's states, which stay as they are: minutes in place of half an hour, and more
mistakes. How many is measured on the development sentences after each fit, kept with the weights and reported at each
use.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file
from torch import nn

from grounding.atomic_files import unfinished_folder
from grounding.benchmark import development_rows, score
from grounding.corpus.paraphrases import LabelledText
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.llm_model import cache_folder
from grounding.parsers.named_encoder import NamedEncoder
from grounding.parsers.spelling import mend
from grounding.training.embedding_parser import calibrate, draw_sentences, loss_of_votes
from grounding.training.slot_network import SlotNetwork

VERSION = 1  # of the fit: a parser of another version in the cache is not used
SENTENCES, EPOCHS, BATCH = 8000, 10, 32
HIDDEN = 64
LEARNING_RATE = 2e-3
REPORT_EVERY = 50  # batches of encoded sentences

# One batch: its labels, the encoder's states (B, T, width) float16 and where they are of the text (B, T) bool.
_Batch = tuple[Sequence[LabelledText], torch.Tensor, torch.Tensor]


def parser_on(
    encoder: NamedEncoder,
    folder: Path | None = None,
    report: Callable[[str], None] = lambda line: None,
    sentences: int = SENTENCES,
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


def _fit(encoder: NamedEncoder, folder: Path, report: Callable[[str], None], sentences: int) -> None:
    """Fit, calibrate and measure heads, and write the folder, all of it or nothing."""
    report(f"fitting a parser to the sentence encoder {encoder.source!r}: {sentences} sentences, once")
    batches = list(_encoded(encoder, sentences, report))
    network = _trained(batches, encoder.state_width)
    reader = network.reader()
    rows = development_rows()
    temperatures = calibrate(reader, encoder, rows, layer=None)
    name = f"embedding on {Path(encoder.source).name}"
    parser = EmbeddingParser(encoder, reader, None, temperatures, name)
    found = score(rows, parser.parse_batch([row.text for row in rows]))
    config = {
        "name": name,
        "encoder_layer": None,
        "layers": 0,
        "width": encoder.state_width,
        "hidden": HIDDEN,
        "temperatures": temperatures,
        "encoder": encoder.source,
        "encoder_sha256": encoder.checksum,
        "sentences": sentences,
        "development": {key: found[key] for key in ("exact", "slots", "false_fills", "refusal")},
    }
    with unfinished_folder(folder) as unfinished:
        save_file(network.state_dict(), unfinished / "model.safetensors")
        (unfinished / "config.json").write_text(json.dumps(config, indent=2) + "\n")
        if not folder.exists():  # else another process was quicker
            unfinished.rename(folder)


def _encoded(encoder: NamedEncoder, count: int, report: Callable[[str], None]) -> Iterator[_Batch]:
    """Draw the training sentences and encode each once, in batches of like length."""
    drawn = sorted(draw_sentences(count, np.random.default_rng(0)), key=lambda entry: len(entry.text))
    for start in range(0, len(drawn), BATCH):
        batch = drawn[start : start + BATCH]
        states = encoder.token_states([mend(entry.text, encoder.whole_words).text for entry in batch])
        yield batch, torch.from_numpy(states.hidden).half(), torch.from_numpy(states.mask)
        if (start // BATCH + 1) % REPORT_EVERY == 0:
            report(f"{start + len(batch)} of {count} sentences encoded")


def _trained(batches: Sequence[_Batch], width: int) -> SlotNetwork:
    """Train heads that have seen every sentence `EPOCHS` times."""
    rng = np.random.default_rng(0)
    with torch.random.fork_rng():
        torch.manual_seed(0)  # initial weights and dropout know no generator of their own
        network = SlotNetwork(layers=0, width=width, hidden=HIDDEN).train()
        optimiser = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE, weight_decay=0.01)
        steps = EPOCHS * len(batches)
        schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, LEARNING_RATE, total_steps=steps + 1, pct_start=0.1)
        for _ in range(EPOCHS):
            for k in rng.permutation(len(batches)):
                labels, hidden, mask = batches[k]
                loss = loss_of_votes(network(hidden.float(), mask), labels)
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(network.parameters(), 1.0)
                optimiser.step()
                schedule.step()
    return network.eval()
