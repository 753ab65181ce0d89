"""Draw failed arrangements, from above and from the robot, with the goal and the failure."""

from __future__ import annotations

import io
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from agent.evaluation.success.results_folder import FAILURES
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.benchmark.success import Row
from structdiffusion.evaluation_protocol import INTERSECTION
from structdiffusion.simulation.world import TabletopWorld

_RENDERED = 960, 720  # pixels of each view, before it is cropped
_HEIGHT = 400  # of each view, pixels
_FONT, _LINE, _MARGIN, _LETTER = 16, 21, 8, 9  # pixels


def pictured(rows: Iterable[Row], most: int) -> Iterator[tuple[str, Row]]:
    """Choose the failed rows that get a picture, each with the path of its file in the folder of the evaluation.

    Args:
        rows: of any planners.
        most: pictures per planner and failure class; the first scenes are chosen, structures in turn.
    """
    counts: Counter[tuple[str, str]] = Counter()
    for row in sorted(rows, key=lambda row: (row["model"], row["number"], row["structure"])):
        kind = row["model"], row["failure"]
        if row["left"] and counts[kind] < most:
            counts[kind] += 1
            scene = f"{row['structure'].replace(' ', '-')}-{row['number']:03d}"
            yield f"{FAILURES}/{row['model']}_{row['failure'].replace(' ', '-')}_{scene}.png", row


def failure_picture(scene: EvaluationScene, row: Row) -> bytes:
    """Draw the result of a failed arrangement; return the bytes of a PNG file.

    Args:
        scene: of the row.
        row: of a planner whose best-ranked arrangement fails (`SceneResult.left`).
    """
    drawn = scene.drawn
    bodies = list(zip(drawn.models, row["left"])) + list(zip(drawn.models, drawn.world_from_initial))[drawn.count :]
    there = [(model, np.asarray(pose)) for model, pose in bodies if pose is not None]
    with TabletopWorld([model for model, _ in there], [pose for _, pose in there], drawn.table, scene.camera) as world:
        views = [_cropped(world.picture(view, *_RENDERED)) for view in ("top", "robot")]
    failed = "where it was predicted" if row["failure"] == INTERSECTION else "as physics left it"
    width = sum(view.width for view in views)
    lines = [
        f"{row['model']}, {row['structure']} {row['number']} of seed {row['seed']}; goal: {scene.spec}",
        f"{row['failure']}, {failed}: {row['verdicts'][0]['detail']}",
    ]
    lines = [part for line in lines for part in textwrap.wrap(line, width // _LETTER, subsequent_indent="    ")]
    sheet = Image.new("RGB", (width, _HEIGHT + len(lines) * _LINE + 2 * _MARGIN), (255, 255, 255))
    sheet.paste(views[0])
    sheet.paste(views[1], (views[0].width, 0))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    for place, line in enumerate(lines):
        pen.text((_MARGIN, _HEIGHT + _MARGIN + place * _LINE), line, font=font, fill=(20, 20, 20))
    buffer = io.BytesIO()
    sheet.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _cropped(picture: np.ndarray) -> Image.Image:
    """Crop a picture (H, W, 3) uint8 to what is not white, and scale it to the height of all views."""
    rows, columns = np.nonzero((picture < 250).any(axis=2))
    shown = Image.fromarray(picture).crop((columns.min(), rows.min(), columns.max() + 1, rows.max() + 1))
    shown = ImageOps.expand(shown, 2 * _MARGIN, (255, 255, 255))
    return shown.resize((round(shown.width * _HEIGHT / shown.height), _HEIGHT), Image.Resampling.LANCZOS)
