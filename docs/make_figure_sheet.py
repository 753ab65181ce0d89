"""Draw the sheet of all figures in the library as they stand after their release in physics.

`python docs/make_figure_sheet.py` writes `docs/images/figures.png`; it takes about two minutes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from agent.rendering.ray_tracing import Stage
from agent.rendering.surfaces import Surface
from grounding.figures.figure import Figure
from grounding.figures.names import figure_named, figure_names
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import layout_item
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.layouts import lay_out
from structdiffusion.objects.blocks import block_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Table
from structdiffusion.protocol.physical_stability import place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.depth_camera import DepthCamera
from structdiffusion.structures.structure import LayoutError

SHEET = Path(__file__).resolve().parent / "images" / "figures.png"
COLUMNS, WIDTH, HEIGHT, TITLE = 10, 150, 118, 14  # tiles in a row, and pixels
COLORS = 64  # of the picture's palette
MORE = 3  # objects beyond the fewest that show a figure, which then is plainer
TABLE = Table()
FORMS = {one.name: one for one in block_objects()}
TRIES = 10


def main() -> None:
    """Write the sheet."""
    names = sorted(figure_names(), key=lambda name: (figure_named(name).stacked, not name.startswith("letter"), name))
    tiles = [tile(figure_named(name)) for name in names]
    rows = -(-len(tiles) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * WIDTH, rows * (HEIGHT + TITLE)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    for number, (name, picture) in enumerate(zip(names, tiles, strict=True)):
        left, top = number % COLUMNS * WIDTH, number // COLUMNS * (HEIGHT + TITLE)
        sheet.paste(Image.fromarray(picture), (left, top))
        pen.text((left + WIDTH / 2, top + HEIGHT + TITLE / 2), name, fill="black", font=font, anchor="mm")
    sheet.quantize(COLORS, dither=Image.Dither.NONE).save(SHEET, optimize=True)
    print(f"{SHEET}: {len(names)} figures, {SHEET.stat().st_size / 1000:.0f} kB")


def tile(figure: Figure) -> np.ndarray:
    """Return the picture (H, W, 3) of a figure that stands, of more objects than the fewest if there is room."""
    counts = [len(figure.blocks)] if figure.stacked else figure.numbers[1::-1] or figure.legal[MORE::-1]
    for count in counts:
        models = objects_of(figure, count)
        try:
            poses = standing(figure, models)
        except LayoutError:
            continue
        if poses is not None:
            return picture(models, poses, figure.stacked)
    raise SystemExit(f"no {figure.name} of {counts} objects stands")


def standing(figure: Figure, models: list[ObjectModel]) -> np.ndarray | None:
    """Return the poses (N, 4, 4) in which objects stand in the end; `None` if they do not show the figure then."""
    rng = np.random.default_rng(0)
    items = [layout_item(model, 0.0) for model in models]
    initial = np.array([pose_from_xyz_yaw(5.0 + i, 5.0, 0.0, 0.0) for i in range(len(models))])
    spec = StructureSpec(figure.name, **({} if figure.stacked else {"size": "small"}))
    for _ in range(TRIES):
        layout = lay_out(items, spec, TABLE, rng)
        goal = np.array([pose_from_xyz_yaw(*at, turn) for at, turn in zip(layout.positions, layout.turns)])
        verdict = place_and_check(TabletopBodies(models, initial, TABLE), goal @ np.linalg.inv(initial), spec)
        if verdict.success:
            return np.asarray(verdict.world_from_final)
    return None


def objects_of(figure: Figure, count: int) -> list[ObjectModel]:
    """Return cylinders for a flat figure, cubes and beams for an upright one."""
    if not figure.stacked:
        return [FORMS["drum_blue"]] * count
    return [FORMS["brick_orange" if block.width > 1 else "cube_35_blue"] for block in figure.blocks_of(count)[0]]


def picture(models: list[ObjectModel], poses: np.ndarray, upright: bool) -> np.ndarray:
    """Return a picture of objects as the reader sees them, who stands on the robot's side."""
    middle = poses[:, :3, 3].mean(axis=0)
    reach = float(np.abs(poses[:, :3, 3] - middle).max()) + 0.05
    away = np.array([-1.0, 0.0, 0.35 if upright else 2.4])
    eye = middle + away / np.linalg.norm(away) * reach * (3.4 if upright else 2.9)
    camera = DepthCamera(eye=tuple(eye), target=tuple(middle), width=WIDTH * 2, height=HEIGHT * 2)
    surfaces = [Surface(model.mesh_vertices, model.mesh_faces, model.color, 0.1) for model in models]
    image = Stage(camera, TABLE, None, surfaces).picture(poses)
    return np.asarray(Image.fromarray(image).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS))


if __name__ == "__main__":
    main()
