"""Read colour, depth and lens from a folder of pictures as data sets have them.

    FOLDER/000004-color.png    # or .jpg; `color`, `colour` or `rgb` in the name, or in that of a folder within FOLDER
    FOLDER/000004-depth.png    # 16 bits of grey; or .tiff, or .npy; `depth` in the name, or in that of its folder
    FOLDER/camera_params.json  # fx, fy, cx, cy, or the matrix K, in one of the usual spellings

The rest of a name without those words identifies the pictures that belong together. Whole numbers are millimetres and
others metres, unless `depth_scale` in the camera's file, or the user, says how many metres a unit is.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import BadInput
from agent.recordings.camera_intrinsics import KNOWN_FILES, find_lens, matrix_of
from agent.recordings.pictures import pixels_of, read_picture
from structdiffusion.limits import MOST_PIXELS

_COLORS, _DEPTHS = (".png", ".jpg", ".jpeg"), (".png", ".npy", ".tif", ".tiff")
_ROLE = re.compile(r"aligned_depth_to_color|depth|colou?r|rgb|image|img|raw")
_NEAREST, _FARTHEST = 0.05, 20.0  # m, of the median: what else a table is not seen at comes of a wrong unit


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
        height, width = self.depth.shape
        (fx, _, cx), (_, fy, cy), _ = self.intrinsics
        points = np.empty((height, width, 3), np.float32)
        points[..., 0] = (np.arange(width) - cx)[None, :] / fx * self.depth
        points[..., 1] = (np.arange(height) - cy)[:, None] / fy * self.depth
        points[..., 2] = self.depth
        return points


def read_rgbd(
    folder: Path,
    name: str | None = None,
    intrinsics: Sequence[float] | None = None,
    depth_scale: float | None = None,
) -> RgbdPicture:
    """Read one measurement from a folder of pictures.

    Args:
        folder: of colour and depth pictures, with the camera's file.
        name: which of several; by default the first.
        intrinsics: fx, fy, cx, cy, pixels, instead of the camera's file.
        depth_scale: metres a unit of the depth picture.

    Raises:
        BadInput: if something is missing or cannot be read; the message says what is there.
    """
    depths, colors = _pictures(folder)
    chosen, notes = _chosen(folder, depths, name)
    values = _depth_values(depths[chosen])
    lens = None if intrinsics is not None else find_lens(folder)
    if lens is not None:
        matrix = lens.intrinsics
        if lens.size not in (None, values.shape[::-1]):
            raise BadInput(
                f"{str(lens.file)!r} is about pictures of {_by(lens.size)} pixels, and {str(depths[chosen])!r} has "
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
    scale = depth_scale or (lens.depth_scale if lens is not None else None)
    depth = _metres(values, scale, depths[chosen])
    used = {"depth": str(depths[chosen].relative_to(folder))}
    color, said = None, ("there is no colour picture",)
    color_file = colors.get(chosen) or (next(iter(colors.values())) if len(colors) == len(depths) == 1 else None)
    if color_file is not None:
        color, said = _color(color_file, depth.shape)
    if color_file is not None and color is not None:
        used["color"] = str(color_file.relative_to(folder))
    used["intrinsics"] = "--intrinsics" if lens is None else str(lens.file.relative_to(folder))
    return RgbdPicture(chosen, depth, color, matrix, used, (*notes, *said))


def _pictures(folder: Path) -> tuple[dict[str, Path], dict[str, Path]]:
    """Group the depth and colour pictures of a folder by the common part of their names, in order."""
    if not folder.is_dir():
        raise BadInput(f"there is no folder {str(folder)!r}")
    depths: dict[str, Path] = {}
    colors: dict[str, Path] = {}
    for path in sorted([*folder.glob("*"), *folder.glob("*/*")]):
        words = path.relative_to(folder).with_suffix("").as_posix().lower()
        name = re.sub(r"[\W_]+", "-", _ROLE.sub("", words)).strip("-")
        if "depth" in words and path.suffix.lower() in _DEPTHS:
            depths.setdefault(name, path)
        elif re.search(r"colou?r|rgb", words) and path.suffix.lower() in _COLORS:
            colors.setdefault(name, path)
    if not depths:
        raise BadInput(
            f"the folder {str(folder)!r} has no depth picture (*depth*{', *depth*'.join(_DEPTHS)}); "
            f"there are: {_listed(folder)}"
        )
    return depths, colors


def _chosen(folder: Path, depths: dict[str, Path], name: str | None) -> tuple[str, tuple[str, ...]]:
    """Return the name of the selected measurement, and a note if there are others."""
    if name is None:
        first = next(iter(depths))
        if len(depths) == 1:
            return first, ()
        return first, (f"the first of {len(depths)} depth pictures was taken, of {_few(list(depths))}",)
    if name not in depths:
        raise BadInput(
            f"the folder {str(folder)!r} has no depth picture named {name!r}; there are: {_few(list(depths))}"
        )
    return name, ()


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


def _metres(values: np.ndarray, scale: float | None, path: Path) -> np.ndarray:
    """Return depths (H, W) float32 in metres, NaN where nothing was measured."""
    whole = values.dtype.kind in "ui"
    scale = scale or (0.001 if whole else 1.0)
    depth = (values * scale).astype(np.float32)
    with np.errstate(invalid="ignore"):
        depth[~((depth > 0) & np.isfinite(depth))] = np.nan
    if np.isnan(depth).all():
        raise BadInput(f"the depth picture {str(path)!r} has no value above 0")
    median = float(np.nanmedian(depth))
    if not _NEAREST <= median <= _FARTHEST:
        raise BadInput(
            f"the depth picture {str(path)!r} would be {median:.3g} m away at {scale:g} m a unit, legal: {_NEAREST:g} "
            f"to {_FARTHEST:g} m; structagent bag from-rgbd DIR --depth-scale METRES --out FILE says the unit"
        )
    return depth


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
