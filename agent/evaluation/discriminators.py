"""Measure how often discriminators are right on held-out data: `structagent evaluate discriminators`."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

import torch
from torch import Tensor

from agent.evaluation.report import (
    Row,
    command_line,
    interval,
    percent,
    print_footer,
    print_table,
    rate_of,
    report_frame,
)
from agent.model_cards.provenance import provenance, require_cards
from agent.runtime.progress import followed
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.data.npz_files import SHEET_NAME
from structdiffusion.evaluation_protocol import MAX_PENETRATION
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.loss import PairBatches
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.loss import KINDS, draw_examples
from structdiffusion.planners.factory import WEIGHTS

_BATCH = 30  # scenes at a time, which make 70 examples; or twice as many pairs
# Depths of penetration, m, by which pairs are grouped: they are hard to judge near the limit of 2 mm.
_DEPTHS = {
    "apart by 5 mm or more": (-torch.inf, -0.005),
    "apart by less, or in by up to 2 mm": (-0.005, MAX_PENETRATION),
           "in by 2 to 7 mm": (MAX_PENETRATION, 0.007), "in by more": (0.007, torch.inf)}  # fmt: skip


def measure_discriminators(
    data: Path, weights: Path | None, examples: int, seed: int, allow_unverified: bool = False
) -> Row:
    """Measure how often the structure and the collision discriminator are right, by kind of example; JSON-ready.

    Args:
        data: folder of `structagent generate` with scenes and objects that were not trained on; scenes of shapes that
            the structure discriminator does not know are left out.
        weights: folder with `structure/` and `collision/`; `None` for the shipped ones.
        examples: number for each network, rounded up to whole batches.
        seed: of the choice of scenes, of camera noise, and of displacements.
        allow_unverified: use checkpoints that differ from their model cards.

    Raises:
        FileNotFoundError, DataFolderError: for a folder without data, or with torn files.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    folder = Path(weights) if weights is not None else WEIGHTS
    if not allow_unverified:
        require_cards(provenance(("structure", "collision"), weights))
    structure = StructureDiscriminator.from_pretrained(folder / "structure")
    collision = CollisionDiscriminator.from_pretrained(folder / "collision")
    scenes = DemonstrationBatches(data, known=structure.config.vocabulary)
    pairs = PairBatches.load(data)
    command = command_line(
        "discriminators", data=data, examples=examples, seed=seed, weights=weights, allow_unverified=allow_unverified
    )
    generated = ""  # the command that generated the data, which the reader does not have
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        generated = json.loads((data / SHEET_NAME).read_text())["command"] + " && "
    evaluations = [
        {"discriminator": "structure", "rows": _structure(structure, scenes, examples, seed)},
        {"discriminator": "collision", "rows": _collision(collision, pairs, examples, seed)},
    ]
    return {**report_frame(generated + command, examples, seed), "evaluations": evaluations}


@torch.no_grad()
def _structure(model: StructureDiscriminator, data: DemonstrationBatches, examples: int, seed: int) -> list[Row]:
    generator = torch.Generator().manual_seed(seed)
    right, kinds = [], []
    rounds = range(-(-examples // (2 * _BATCH + _BATCH // 3)))
    for _ in followed("batches of scenes", iter(rounds), len(rounds)):
        drawn = draw_examples(data, generator, _BATCH, model.config.vocabulary)
        logits = model(drawn.clouds, drawn.present, drawn.nouns, drawn.words)
        right.append((logits > 0) == (drawn.right > 0.5))
        kinds.append(drawn.kind)
    kind = torch.cat(kinds)
    return _rows(torch.cat(right), {name: kind == number for number, name in enumerate(KINDS)})


@torch.no_grad()
def _collision(model: CollisionDiscriminator, data: PairBatches, examples: int, seed: int) -> list[Row]:
    generator = torch.Generator().manual_seed(seed)
    right, depths = [], []
    rounds = range(-(-examples // (2 * _BATCH)))
    for _ in followed("batches of pairs", iter(rounds), len(rounds)):
        first, second, distance = data.draw(2 * _BATCH, generator)
        right.append((model(first, second) > 0) == (distance < -MAX_PENETRATION))
        depths.append(-distance)
    depth = torch.cat(depths)
    groups = {name: (low < depth) & (depth <= high) for name, (low, high) in _DEPTHS.items()}
    return _rows(torch.cat(right), groups)


def _rows(right: Tensor, groups: dict[str, Tensor]) -> list[Row]:
    """Return a row for all examples, then one for each group (E,) that has any."""
    whole = {"all": torch.ones_like(right), **groups}
    found = ((name, right[chosen.to(right.device)].tolist()) for name, chosen in whole.items())
    return [{"of": name, **rate_of(hits)} for name, hits in found if hits]


def print_discriminators(report: Row, results: TextIO) -> None:
    """Print the table: a row per discriminator and kind of example."""
    table: list[Sequence[str]] = [["discriminator", "examples", "n", "right", "95 %"]]
    for evaluation in report["evaluations"]:
        for row in evaluation["rows"]:
            rate = [percent(row["rate"], 1), interval(row, 1)]
            table.append([evaluation["discriminator"], row["of"], str(row["n"]), *rate])
    print_table(table, results, left=2)
    print_footer(report, results, "in percent, with 95 % Wilson intervals")
