"""Read colour, depth and lens from a folder of pictures as data sets have them.

    FOLDER/000004-color.png    # or .jpg; `color`, `colour` or `rgb` in the name, or in that of a folder within FOLDER;
                               # where there are none, a .jpg or an `image` of the depth picture's name
    FOLDER/000004-depth.png    # 16 bits of grey; or .tiff, or .npy; `depth` in the name, or in that of its folder
    FOLDER/camera_params.json  # fx, fy, cx, cy, or the matrix K, in one of the usual spellings

A colour picture goes with a depth picture by a file that lists pairs (TUM's associations.txt), by the rest of their
names without those words, or by the nearest time. Whole numbers are millimetres and others metres, unless `depth_scale`
in the camera's file, or the user, says how many metres a unit is, or what is seen contradicts that.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.recordings.camera_intrinsics import KNOWN_FILES, CameraFile, find_lens, matrix_of
from agent.recordings.depth_units import IN_PICTURES, MILLIMETRE, fitting_unit
from agent.recordings.message_decoding import FARTHEST
from agent.recordings.picture_pairs import Pair, pairs_of, why_none
from agent.recordings.pictures import pixels_of, read_picture
from agent.recordings.point_count import lens_of_every, step_of
from structdiffusion.limits import MOST_PIXELS

_COLORS, _DEPTHS = (".png", ".jpg", ".jpeg"), (".png", ".npy", ".tif", ".tiff")
_ROLE = re.compile(r"aligned_depth_to_color|depth|colou?r|rgb|image|img|frame|raw")


@dataclass(frozen=True)
class RgbdPicture:
    """One measurement of a depth camera from disk.

    Attributes:
        name: what its files have in common, such as "000004".
        depth: (H, W) float32 metres, NaN where nothing was measured.
        color: (H, W, 3) uint8 RGB, or `None`.
        intrinsics: (3, 3), pixels; pixel centres lie at whole numbers.
        used: "depth", "color" and "intrinsics" -> the file.
        notes: assumptions and omissions, a sentence each.
    """

    name: str
    depth: np.ndarray
    color: np.ndarray | None
    intrinsics: np.ndarray
    used: dict[str, str]
    notes: tuple[str, ...] = ()

    @property
    def points(self) -> np.ndarray:
        """Return points (H, W, 3) float32, the camera's optical frame, metres."""
        return in_space(self.depth, self.intrinsics)


def in_space(depth: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """Return points (H, W, 3) float32 of depths (H, W) in the same unit, in the camera's optical frame."""
    height, width = depth.shape
    (fx, _, cx), (_, fy, cy), _ = intrinsics
    points = np.empty((height, width, 3), np.float32)
    points[..., 0] = (np.arange(width) - cx)[None, :] / fx * depth
    points[..., 1] = (np.arange(height) - cy)[:, None] / fy * depth
    points[..., 2] = depth
    return points


def read_rgbd(
    folder: Path,
    name: str | None = None,
    intrinsics: Sequence[float] | None = None,
    depth_unit: float | None = None,
) -> RgbdPicture:
    """Read one measurement from a folder of pictures.

    Args:
        folder: of colour and depth pictures, with the camera's file.
        name: which of several; by default the first.
        intrinsics: fx, fy, cx, cy, pixels, instead of the camera's file.
        depth_unit: metres a unit of the depth picture.

    Raises:
        BadInput: if something is missing or cannot be read; the message says what is there.
    """
    depths, colors = _pictures(folder)
    pairs = pairs_of(folder, depths, colors)
    chosen, notes = _chosen(folder, depths, pairs, name)
    values = _depth_values(depths[chosen])
    lens = None if intrinsics is not None else find_lens(folder, chosen, list(depths))
    if lens is not None:
        matrix = lens.intrinsics
        if lens.size is not None and lens.size != values.shape[::-1]:
            raise BadInput(
                f"{str(lens.file)!r} is for pictures of {_by(lens.size)} pixels, but {str(depths[chosen])!r} has "
                f"{_by(values.shape[::-1])}"
            )
    elif intrinsics is not None:
        matrix = matrix_of(*intrinsics)
    else:
        raise BadInput(
            f"the folder {str(folder)!r} has no file with fx, fy, cx and cy ({KNOWN_FILES}); there are: "
            f"{_listed(folder)}; "
            "structagent bag from-rgbd DIR --intrinsics FX,FY,CX,CY --out FILE makes a bag with them"
        )
    _check_lens(matrix, values.shape)
    depth, told = _metres(values, matrix, depth_unit, lens, depths[chosen])
    used = {"depth": str(depths[chosen].relative_to(folder))}
    color: np.ndarray | None = None
    said: tuple[str, ...] = (
        f"there is no colour picture: no {', '.join(_COLORS)} has color, colour or rgb in its name",
    )
    if chosen in pairs:
        color, said = _color(pairs[chosen].color, depth.shape)
        said = (pairs[chosen].note, *said) if pairs[chosen].note and color is not None else said
    elif colors:
        said = (why_none(folder, depths[chosen], colors),)
    if color is not None:
        used["color"] = str(pairs[chosen].color.relative_to(folder))
    used["intrinsics"] = "--intrinsics" if lens is None else str(lens.file.relative_to(folder))
    return RgbdPicture(chosen, depth, color, matrix, used, (*notes, *told, *said))


def _pictures(folder: Path) -> tuple[dict[str, Path], dict[str, Path]]:
    """Group the depth and colour pictures of a folder by the common part of their names, in order."""
    if not folder.is_dir():
        raise BadInput(f"there is no folder {str(folder)!r}")
    depths: dict[str, Path] = {}
    colors: dict[str, Path] = {}
    others: dict[str, Path] = {}  # that are no masks either: those are not stored with losses
    for path in sorted([*folder.glob("*"), *folder.glob("*/*")]):
        words = path.relative_to(folder).with_suffix("").as_posix().lower()
        name = _name(words)
        if "depth" in words and path.suffix.lower() in _DEPTHS:
            depths.setdefault(name, path)
        elif re.search(r"colou?r|rgb", words) and path.suffix.lower() in _COLORS:
            colors.setdefault(name, path)
        elif path.suffix.lower() in (".jpg", ".jpeg") or "image" in words and path.suffix.lower() in _COLORS:
            others.setdefault(name, path)
    if not depths:
        raise BadInput(
            f"the folder {str(folder)!r} has no depth picture (*depth*{', *depth*'.join(_DEPTHS)}); "
            f"there are: {_listed(folder)}"
        )
    return depths, colors or {name: path for name, path in others.items() if name in depths}


def _name(words: str) -> str:
    """Return what a picture's path without its suffix says beside the words for its kind."""
    return re.sub(r"[\W_]+", "-", _ROLE.sub("", words.lower())).strip("-")


def _chosen(
    folder: Path, depths: dict[str, Path], pairs: Mapping[str, Pair], name: str | None
) -> tuple[str, tuple[str, ...]]:
    """Return the name of the selected measurement, and a note if there are others; the first with colour by default."""
    if name is None:
        first = next((name for name in depths if name in pairs), next(iter(depths)))
        if len(depths) == 1:
            return first, ()
        which = "" if first == next(iter(depths)) else " with a colour picture"
        return first, (f"the first{which} of {len(depths)} depth pictures was taken, of {_few(list(depths))}",)
    if name in depths:
        return name, ()
    if _name(name) in depths:  # as the file has it: 1305031102.160407
        return _name(name), ()
    raise BadInput(f"the folder {str(folder)!r} has no depth picture named {name!r}; there are: {_few(list(depths))}")


def _depth_values(path: Path) -> np.ndarray:
    """Return the numbers (H, W) of a depth picture, in its own unit."""
    try:
        if path.suffix.lower() == ".npy":
            # Mapped, because a damaged header can claim any size.
            values = np.squeeze(np.load(path, mmap_mode="r", allow_pickle=False))
        else:
            values = _open_picture(path, ("PNG", "TIFF"), "16 bits of grey", ("I", "F"))
    except (ValueError, EOFError, OSError) as error:
        raise BadInput(f"the depth picture {str(path)!r} cannot be read: {error}") from error
    if values.ndim != 2 or 0 in values.shape or values.size > MOST_PIXELS or values.dtype.kind not in "uif":
        shape = " x ".join(map(str, values.shape))
        raise BadInput(
            f"the depth picture {str(path)!r} has {shape} values of type {values.dtype}; legal: rows x columns of "
            "numbers"
        )
    return np.asarray(values)


def _open_picture(path: Path, formats: Sequence[str], legal: str, modes: Sequence[str] = ()) -> np.ndarray:
    """Return the pixels of a picture: unchanged if its mode is one of `modes`, otherwise as RGB."""
    try:
        picture = read_picture(path, formats)
        if modes and not picture.mode.startswith(tuple(modes)):
            raise BadInput(f"it is of the kind {picture.mode!r}")
        return pixels_of(picture, "" if modes else "RGB")
    except BadInput as error:
        raise BadInput(f"the picture {str(path)!r} cannot be read: {error}; legal: {legal}") from error
    except OSError as error:
        raise BadInput(f"the picture {str(path)!r} cannot be read: {error.strerror or error}") from error


def _metres(
    values: np.ndarray, matrix: np.ndarray, given: float | None, lens: CameraFile | None, path: Path
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return depths (H, W) float32 in metres, NaN where nothing was measured, and notes on their unit."""
    stored = values.astype(np.float32)
    with np.errstate(invalid="ignore"):
        stored[~((stored > 0) & np.isfinite(stored))] = np.nan
    if np.isnan(stored).all():
        raise BadInput(f"the depth picture {str(path)!r} has no value above 0")
    unit, said = given, ""
    if given is None:
        whole = values.dtype.kind in "ui"
        scale = None if lens is None else lens.depth_unit(whole)
        declared = scale or (MILLIMETRE if whole else 1.0)
        step = step_of(*stored.shape)
        points = in_space(stored[::step, ::step], lens_of_every(matrix, step))
        unit, said = fitting_unit(points, declared, IN_PICTURES, f"the depths in {path.name!r}")
    depth = (values * unit).astype(np.float32)
    with np.errstate(invalid="ignore"):
        depth[~((depth > 0) & (depth < FARTHEST))] = np.nan
    if np.isnan(depth).all():
        raise BadInput(f"the depth picture {str(path)!r} has no value below {FARTHEST:g} m at {unit:g} m a unit")
    return depth, (said,) if said else ()


def _color(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Return the colours for a depth picture (H, W), and how they were adapted to it."""
    color = _open_picture(path, ("PNG", "JPEG"), "a PNG or JPEG picture")
    (height, width), (rows, columns) = shape, color.shape[:2]
    if (rows, columns) == (height, width):
        return color, ()
    sizes = f"{columns} x {rows} pixels, and the depth picture {_by((width, height))}"
    if abs(rows * width - columns * height) > max(width, height):
        return None, (f"the colour picture was left out: it has {sizes}",)
    from PIL import Image

    scaled = np.array(Image.fromarray(color).resize((width, height), Image.Resampling.BILINEAR))
    return scaled, (f"the colour picture was scaled: it has {sizes}",)


def _check_lens(matrix: np.ndarray, shape: tuple[int, int]) -> None:
    (fx, _, cx), (_, fy, cy), _ = matrix
    height, width = shape
    if not (fx > 0 and fy > 0 and 0 < cx < width and 0 < cy < height):
        raise BadInput(
            f"the intrinsics fx {fx:g}, fy {fy:g}, cx {cx:g}, cy {cy:g} do not fit a picture of {_by((width, height))} "
            "pixels: the focal lengths must be positive, and the middle within the picture"
        )


def _by(size: Sequence[int]) -> str:
    return f"{size[0]} x {size[1]}"


def _listed(folder: Path) -> str:
    return _few(sorted(path.name for path in folder.iterdir()))


def _few(names: Sequence[str]) -> str:
    """Join some names and the number of the rest."""
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return (", ".join(names[:8]) or "nothing") + more
