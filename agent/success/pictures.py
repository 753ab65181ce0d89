"""Pictures of arrangements that failed: from above and from the robot, with what was asked and what failed."""

from __future__ import annotations

import io
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from structdiffusion.evaluation import Row
from structdiffusion.evaluation_scenes import EvaluationScene
from structdiffusion.tabletop import TabletopWorld

FOLDER = "failures"
_WIDTH, _HEIGHT = 560, 420  # of each view, pixels
_FONT, _LINE, _MARGIN, _CHARACTERS = 16, 21, 8, 130


def pictured(rows: Iterable[Row], most: int) -> Iterator[tuple[str, Row]]:
    """The failed rows that get a picture, each with its file's place in the evaluation's folder.

    Args:
        rows: of any planners.
        most: pictures per planner and failure class; those of the first scenes, all structures in turn.
    """
    counts: Counter[tuple[str, str]] = Counter()
    for row in sorted(rows, key=lambda row: (row["model"], row["number"], row["structure"])):
        kind = row["model"], row["failure"]
        if row["left"] and counts[kind] < most:
            counts[kind] += 1
            scene = f"{row['structure'].replace(' ', '-')}-{row['number']:03d}"
            yield f"{FOLDER}/{row['model']}_{row['failure'].replace(' ', '-')}_{scene}.png", row


def failure_picture(scene: EvaluationScene, row: Row) -> bytes:
    """The bytes of a PNG file: what is left of a failed arrangement.

    Args:
        scene: that of the row.
        row: of a planner whose best-ranked arrangement fails (`SceneResult.left`).
    """
    drawn = scene.drawn
    bodies = list(zip(drawn.models, row["left"])) + list(zip(drawn.models, drawn.world_from_initial))[drawn.count :]
    there = [(model, np.asarray(pose)) for model, pose in bodies if pose is not None]
    with TabletopWorld([model for model, _ in there], [pose for _, pose in there], drawn.table, scene.camera) as world:
        views = [world.picture(view, _WIDTH, _HEIGHT) for view in ("top", "robot")]
    failed = "where it was predicted" if row["failure"] == "intersection" else "as physics left it"
    lines = [
        f"{row['model']}, {row['structure']} {row['number']} (seed {row['seed']}): {scene.spec}",
        f"{row['failure']}, {failed}: {row['verdicts'][0]['detail']}",
    ]
    lines = [part for line in lines for part in textwrap.wrap(line, _CHARACTERS, subsequent_indent="    ")]
    sheet = Image.new("RGB", (2 * _WIDTH, _HEIGHT + len(lines) * _LINE + 2 * _MARGIN), (255, 255, 255))
    sheet.paste(Image.fromarray(np.hstack(views)))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    for place, line in enumerate(lines):
        pen.text((_MARGIN, _HEIGHT + _MARGIN + place * _LINE), line, font=font, fill=(20, 20, 20))
    buffer = io.BytesIO()
    sheet.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()
