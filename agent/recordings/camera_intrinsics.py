"""Find a camera's intrinsics in the files that datasets store with their images."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.decimal_commas import decimal_comma, is_decimal_comma, refusal
from agent.runtime.yaml_files import load_yaml
from structdiffusion.limits import LENS_BYTES

KNOWN_FILES = "camera_params.json, camera.json, intrinsics.json, camera_info.yaml or K.txt"
_SUFFIXES = (".json", ".yaml", ".yml", ".txt")
_WORDS = ("camera", "intrinsic", "calib", "k.")  # of files that are looked into first; other texts never
_MATRICES = ("k", "cam_k", "camera_matrix", "intrinsic_matrix", "intrinsics", "intrinsic")
_CENTERS = (("cx", "cy"), ("ppx", "ppy"), ("x_offset", "y_offset"))
_KEYS = {"fx", "fy", *(key for pair in _CENTERS for key in pair), *_MATRICES}
_SIZES = (("width", "height"), ("img_width", "img_height"), ("image_width", "image_height"))
_COARSEST = 0.01  # m
_UNIT = re.compile(r"(\w+_)?depth_?(map_?)?(scale|factor|units?)|factor_depth")  # keys


@dataclass(frozen=True)
class CameraFile:
    """A pinhole lens as a file describes it.

    Attributes:
        intrinsics: (3, 3), pixels.
        size: width and height of the pictures that it holds for, or `None`.
        depth_scale: the file's number for the unit of the depth pictures, or `None`.
        file: the file that describes it.
        millimetres: whether that number is in millimetres a unit, as in data sets of BOP.
    """

    intrinsics: np.ndarray
    size: tuple[int, int] | None
    depth_scale: float | None
    file: Path
    millimetres: bool = False

    def depth_unit(self, whole: bool) -> float | None:
        """Return metres a unit of the depth pictures, or `None` if the file does not say it.

        Files give metres a unit, or units a metre, which are more than one, or millimetres a unit: whole numbers
        (`whole`) of more than a centimetre would be too coarse for any depth.
        """
        scale = self.depth_scale
        if scale is None:
            return None
        if self.millimetres or whole and _COARSEST < scale <= 1.0:
            return scale / 1000.0
        return scale if scale <= 1.0 else 1.0 / scale


def find_lens(folder: Path, name: str = "", names: Sequence[str] = ()) -> CameraFile | None:
    """Find the lens that a file in the folder describes; files with the most likely names are tried first.

    Args:
        folder: the folder.
        name: of the picture: its own camera goes before others, in a file of its own or in one of many cameras.
        names: of all pictures; a file that is named for another one is passed over.

    Raises:
        BadInput: for a file named for it that cannot be read, or that has cameras of other pictures alone.
    """
    below = [path for path in folder.glob("*/*") if _is_named(path)]  # others there may be one for each picture
    files = [path for path in (*folder.iterdir(), *below) if path.suffix.lower() in _SUFFIXES and path.is_file()]
    # The folder's own before those of a folder in it, and in each what is not said to be about the colour picture.
    files.sort(key=lambda path: (len(path.parts), _of_color(path), path))
    others = set(names) - {name, ""}
    files = [path for path in files if not others & (words := _words_of(path)) or name in words]
    files.sort(key=lambda path: name not in _words_of(path))
    named = [path for path in files if _is_named(path)]
    for path in named:
        if (lens := _lens_of(path, name)) is not None:
            return lens
    for path in files:
        if path not in named and path.suffix.lower() != ".txt":
            try:
                lens = _lens_of(path, name)
            except BadInput:  # it need not be about a camera at all
                continue
            if lens is not None:
                return lens
    return None


def _is_named(path: Path) -> bool:
    return any(word in path.name.lower() for word in _WORDS)


def _of_color(path: Path) -> bool:
    return re.search(r"colou?r|rgb", path.stem.lower()) is not None


def _words_of(path: Path) -> set[str]:
    """Return the parts of a file's name, and the whole without its last word: 000004-camera is 000004's."""
    parts = [part for part in re.split(r"[\W_]+", path.stem.lower()) if part]
    return {*parts, "-".join(parts[:-1]), "-".join(parts[1:])}


def matrix_of(fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """Return the matrix (3, 3) of focal lengths and principal point, pixels."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _lens_of(path: Path, name: str) -> CameraFile | None:
    if (size := path.stat().st_size) > LENS_BYTES:
        raise BadInput(f"the camera's file {str(path)!r} has {size} bytes; at most {LENS_BYTES} are read")
    try:
        text = path.read_text(encoding="utf-8-sig")
        if path.suffix.lower() == ".txt":
            if number := decimal_comma(text.splitlines()):
                raise refusal(f"the camera's file {str(path)!r}", number)
            rows = [[float(value) for value in line.replace(",", " ").split()] for line in text.splitlines() if line]
            matrix = _matrix([value for row in rows for value in row])
            return None if matrix is None else CameraFile(matrix, None, None, path)
        found = _parsed(text, path.suffix.lower())
    except (ValueError, RecursionError) as error:
        raise BadInput(f"the camera's file {str(path)!r} cannot be read: {error}") from error
    found = _own_entry(found, name, path)
    for values in _mappings(found):
        if (matrix := _matrix_in(values)) is not None:
            scale = _scale_in([values, *_mappings(found)])
            return CameraFile(matrix, _size_in(values), scale, path, "cam_k" in values)
    for values in _mappings(found):
        for key, value in values.items():
            if isinstance(value, str) and key in _KEYS and is_decimal_comma(value):
                raise refusal(f"{key} in the camera's file {str(path)!r}", value)
    return None


def _own_entry(found: Any, name: str, path: Path) -> Any:
    """Return the entry of a picture in a file that has a camera for each number of a picture; anything else unchanged.

    Raises:
        BadInput: if it has cameras that differ, and none of the picture.
    """
    if not isinstance(found, Mapping) or not found or not all(str(key).isdecimal() for key in found):
        return found
    number = re.search(r"\d+$", name)
    for key, value in found.items():
        if number is not None and int(key) == int(number[0]):
            return value
    values = list(found.values())
    if all(value == values[0] for value in values):
        return values[0]
    keys = [str(key) for key in found]
    few = ", ".join(keys[:8]) + (f" and {len(keys) - 8} more" if len(keys) > 8 else "")
    raise BadInput(f"{str(path)!r} has cameras of the pictures {few}, and none of {name!r}")


def _parsed(text: str, suffix: str) -> Any:
    if suffix == ".json":
        return json.loads(text)
    # OpenCV writes a first line that is no YAML, and names the type of a matrix.
    return load_yaml(re.sub(r"\A%YAML:.*|!!opencv-matrix\b", "", text))


def _mappings(found: Any) -> Iterator[Mapping[str, Any]]:
    """Yield a mapping and those nested in it, their keys in lower case without what is before a dot (`Camera.fx`)."""
    if isinstance(found, Mapping):
        plain: dict[str, Any] = {}
        for key, value in found.items():
            plain.setdefault(str(key).lower().rpartition(".")[2], value)  # of Camera1.fx and Camera2.fx the first
        yield plain
        for value in found.values():
            yield from _mappings(value)
    elif isinstance(found, list):
        for value in found:
            yield from _mappings(value)


def _matrix_in(values: Mapping[str, Any]) -> np.ndarray | None:
    for x, y in _CENTERS:
        numbers = [values.get(key) for key in ("fx", "fy", x, y)]
        if all(_is_number(value) for value in numbers):
            return matrix_of(*map(float, numbers))  # type: ignore[arg-type]
    for key in _MATRICES:
        value = values.get(key)
        flat = value.get("data") if isinstance(value, Mapping) else value
        if isinstance(flat, list) and flat and all(isinstance(row, list) for row in flat):
            flat = [entry for row in flat for entry in row]
        if isinstance(flat, list) and all(_is_number(entry) for entry in flat):
            matrix = _matrix([float(entry) for entry in flat])
            if matrix is not None:
                return matrix
    return None


def _matrix(numbers: Sequence[float]) -> np.ndarray | None:
    """Return the intrinsics from 4 numbers (fx, fy, cx, cy), or 9 or 16 by rows or columns; `None` if they are
    none.
    """
    if not all(map(math.isfinite, numbers)):
        return None
    if len(numbers) == 4:
        return matrix_of(*numbers)
    if len(numbers) not in (9, 16):
        return None
    side = math.isqrt(len(numbers))
    matrix = np.array(numbers).reshape(side, side)[:3, :3]
    if matrix[0, 2] == 0.0 and matrix[2, 0] > 0.0:
        matrix = matrix.T
    # A pose can look like a lens, but for a focal length of one pixel.
    return matrix if matrix[0, 0] > 1 and matrix[1, 1] > 1 and matrix[2, 2] == 1.0 else None


def _size_in(values: Mapping[str, Any]) -> tuple[int, int] | None:
    for width, height in _SIZES:
        if _is_number(values.get(width)) and _is_number(values.get(height)):
            return int(values[width]), int(values[height])
    return None


def _scale_in(places: Sequence[Mapping[str, Any]]) -> float | None:
    """Return a file's number for the unit of depths, whatever it means."""
    for values in places:
        for key, value in values.items():
            if _UNIT.fullmatch(key) and _is_number(value) and value > 0:
                return float(value)
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
