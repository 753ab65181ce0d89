"""Read and write scene files: YAML, checked line by line; errors name the line of the file.

    version: 1                # of this schema; needed
    objects:                  # needed; at most 40
      - mesh: ycb/025_mug     # needed: LIBRARY/OBJECT, or a mesh FILE (or FILE/NODE) seen from this file's folder
        x: 0.40               # needed: metres away from the arm's mounting point; the table spans 0.18 to 0.72
        y: -0.10              # needed: metres to the arm's left; the table spans -0.45 to 0.45
        yaw: 90               # degrees about z, counter-clockwise seen from above; 0 if it is left out, as all below
        z: 0                  # metres from the table top to the object's lowest point
        roll: 0               # degrees about the object's front, before pitch and yaw
        pitch: 0              # degrees about its left, after roll and before yaw
        name: grandma's mug   # unique; by default the noun, numbered where there are several
        noun: mug             # what people call it; by default what the library or the file's name says
        color: blue           # one of COLORS or "#rrggbb", quoted; by default the mesh's own

LIBRARY is one of `structdiffusion.objects.libraries.LIBRARIES`, OBJECT a name in it, with or without its number
("025_mug", "mug"), or a noun that only one of its objects has. The place (x, y) is that of the object's origin: the
middle of its footprint as it rests. A file that is read and written again is the same but for comments and layout.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from agent.errors import BadInput
from grounding.atomic_files import write_whole
from structdiffusion.limits import SCENE_BYTES

VERSION = 1
MOST_OBJECTS = 40
COLORS = {
    "red": "#c62121", "orange": "#ed801f", "yellow": "#edc726", "green": "#338c40", "blue": "#264db3",
    "purple": "#6b2e6b", "pink": "#e68c99", "brown": "#734526", "black": "#1f1f21", "gray": "#9ea1a6",
    "white": "#edede6",
}  # fmt: skip
SUFFIXES = (".yaml", ".yml")

_LONGEST_TEXT = 80
_DEEPEST = -0.002  # m; what lies on a table in physics sinks in by less
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_ELSEWHERE_CALLED = {"category": "noun", "colour": "color", "file": "mesh", "object": "mesh", "rotation": "yaw"}


@dataclass(frozen=True)
class PlacedObject:
    """One object of a scene file: the keys of the schema, lengths in metres, angles in degrees.

    `line` is where it begins in its file, counted from 1; 0 if it comes from no file. `unread` are the keys whose
    values are missing or wrong there, and those that an unknown key may have meant: their values here mean nothing.
    """

    mesh: str
    x: float
    y: float
    yaw: float = 0.0
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    name: str | None = None
    noun: str | None = None
    color: str | None = None
    line: int = field(default=0, compare=False)
    unread: frozenset[str] = field(default=frozenset(), compare=False)


@dataclass(frozen=True)
class Problem:
    """An error in a scene file, and its line, counted from 1."""

    line: int
    message: str


class SceneFileError(BadInput):
    """Raised if a scene file cannot be used; the message is the first problem, and `problems` has all of them."""

    def __init__(self, path: Path, problems: Sequence[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.line))
        first, more = self.problems[0], len(self.problems) - 1
        rest = f" (and {more} more, see: structagent scene validate {path})" if more else ""
        super().__init__(f"{path}:{first.line}: {first.message}{rest}")


KEYS = tuple(entry.name for entry in fields(PlacedObject) if entry.compare)
_NUMBERS = ("x", "y", "yaw", "z", "roll", "pitch")
_NEEDED = ("mesh", "x", "y")
_COUNTED_FROM_ZERO = ("yaw", "z", "roll", "pitch")  # what an unknown key may have meant, where it is left out


def read_text(path: Path) -> str:
    """Return the text of a scene file.

    Raises:
        BadInput: if there is no such file, or it is no text.
    """
    if not path.is_file():
        raise BadInput(f"there is no scene file {str(path)!r}; structagent scene new --out {path} creates one")
    if (size := path.stat().st_size) > SCENE_BYTES:
        raise BadInput(f"the scene file {str(path)!r} has {size} bytes; at most {SCENE_BYTES} are read")
    content = path.read_bytes()
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise SceneFileError(path, [Problem(line, f"byte {content[error.start]:#04x} is not UTF-8 text")]) from error


def parse_scene(text: str) -> tuple[tuple[PlacedObject, ...], list[Problem]]:
    """Return the valid objects of a scene file's text, and its problems."""
    import yaml

    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = ", ".join(part for part in (error.context, error.problem) if part)
        return (), [Problem(mark.line + 1 if mark else 1, f"this is not YAML: {what}")]
    except yaml.reader.ReaderError as error:
        line = text[: error.position].count("\n") + 1
        return (), [Problem(line, f"this is not YAML: the character {chr(error.character)!r} is not allowed")]
    except RecursionError:
        return (), [Problem(1, "this is not a scene: it is nested too deeply")]
    reader = _Reader()
    objects = reader.scene(root)
    return tuple(objects), reader.problems


class _Reader:
    """A reader of YAML nodes that collects problems."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def _note(self, node: Any, message: str) -> None:
        self.problems.append(Problem(_line(node), message))

    def scene(self, root: Any) -> list[PlacedObject]:
        if root is None:
            self.problems.append(Problem(1, "the file is empty; a scene has the keys version and objects"))
            return []
        keys = self._mapping(root, "a scene", ("version", "objects"))
        if keys is None:
            return []
        for key in ("version", "objects"):
            if key not in keys:
                known = f"version: {VERSION}" if key == "version" else "objects: and a list"
                self._note(root, f"the scene has no {key!r}; it needs {known}")
        if "version" in keys and _plain(keys["version"]) != str(VERSION):
            self._note(keys["version"], f"version {_shown(keys['version'])} is not known; legal: {VERSION}")
        listed = keys.get("objects")
        if listed is None:
            return []
        if not _is(listed, "sequence") or not listed.value:
            given = "an empty one" if _is(listed, "sequence") else _shown(listed)
            self._note(listed, f"objects must be a list with at least one object, not {given}")
            return []
        if len(listed.value) > MOST_OBJECTS:
            too_many = listed.value[MOST_OBJECTS]
            self._note(too_many, f"{len(listed.value)} objects are too many; legal: 1 to {MOST_OBJECTS}")
        objects = []
        names: dict[str, int] = {}
        for node in listed.value[:MOST_OBJECTS]:
            placed = self._object(node)
            if placed is None:
                continue
            if placed.name is not None and placed.name in names:
                self._note(node, f"the name {placed.name!r} is taken by the object in line {names[placed.name]}")
            elif placed.name is not None:
                names[placed.name] = placed.line
            objects.append(placed)
        return objects

    def _object(self, node: Any) -> PlacedObject | None:
        """Read one object as far as possible; `None` if it is not one."""
        unread: set[str] = set()
        keys = self._mapping(node, "an object", KEYS, unread)
        if keys is None:
            return None
        for key in _NEEDED:
            if key not in keys:
                self._note(node, f"the object has no {key!r}; it needs mesh, x and y")
                unread.add(key)
        values: dict[str, Any] = {"mesh": "", "x": 0.0, "y": 0.0}
        for key, value in keys.items():
            before = len(self.problems)
            read = self._number(value, key) if key in _NUMBERS else self._text(value, key)
            if len(self.problems) == before:
                values[key] = read
            else:
                unread.add(key)
        return PlacedObject(**values, line=_line(node), unread=frozenset(unread))

    def _mapping(
        self, node: Any, what: str, legal: Sequence[str], unread: set[str] | None = None
    ) -> dict[str, Any] | None:
        """Return the known keys of a mapping with the nodes of their values; add to `unread` the keys that unknown
        ones may mean.
        """
        unread = set() if unread is None else unread
        if not _is(node, "mapping"):
            self._note(node, f"{what} must have the keys {', '.join(legal)}, but this is {_shown(node)}")
            return None
        found: dict[str, Any] = {}
        for key_node, value in node.value:
            key = _plain(key_node) or _shown(key_node)
            if key not in legal:
                near = get_close_matches(key.lower(), legal, n=1)
                intended = _ELSEWHERE_CALLED.get(key.lower(), near[0] if near else None)
                unread.update((intended,) if intended and intended in legal else _COUNTED_FROM_ZERO)
                hint = f"did you mean {intended!r}?" if intended in legal else f"legal keys: {', '.join(legal)}"
                self._note(key_node, f"unknown key {key!r} in {what}; {hint}")
            elif key in found:
                self._note(key_node, f"the key {key!r} is there twice, first in line {_line(found[key])}")
                unread.add(key)
            else:
                found[key] = value
        return found

    def _number(self, node: Any, key: str) -> float:
        plain = _plain(node)
        unit = "metres" if key in ("x", "y", "z") else "degrees"
        if plain is None or node.style or not _DECIMAL.fullmatch(plain) or not math.isfinite(float(plain)):
            quoted = " in quotes" if plain is not None and node.style else ""
            self._note(node, f"{key} must be a number in {unit}, not {_shown(node)}{quoted}")
            return 0.0
        if key == "z" and float(plain) < _DEEPEST:
            self._note(node, f"z {plain} lies below the table top; legal: 0 and more")
        return float(plain)

    def _text(self, node: Any, key: str) -> str:
        plain = _plain(node)
        text = "" if plain is None else plain.strip()
        if not text:
            hint = ', such as "#2050ff" in quotes, because # begins a comment' if key == "color" else ""
            self._note(node, f"{key} must be a word, not {_shown(node)}{hint}")
        elif len(text) > _LONGEST_TEXT and key != "mesh" or not text.isprintable():
            self._note(node, f"{key} must be one printable line of at most {_LONGEST_TEXT} characters")
        elif key == "color" and rgb(text) is None:
            self._note(node, f'color cannot be {text!r}; legal: {", ".join(COLORS)} or "#rrggbb"')
        return text


def _is(node: Any, kind: str) -> bool:
    return node.id == kind


def _line(node: Any) -> int:
    return node.start_mark.line + 1


def _plain(node: Any) -> str | None:
    """Return the text of a scalar, or `None`, also for the empty value of `key:`."""
    return node.value if _is(node, "scalar") and not node.tag.endswith(":null") else None


def _shown(node: Any) -> str:
    """Format a value for an error message."""
    if not _is(node, "scalar"):
        return "a list" if _is(node, "sequence") else "a group of keys"
    text = node.value if len(node.value) <= _LONGEST_TEXT else node.value[:_LONGEST_TEXT] + "..."
    return repr(text) if text else "nothing"


def rgb(color: str) -> tuple[float, float, float] | None:
    """Return a colour of the schema as RGB in [0, 1]; `None` if it is not valid."""
    code = COLORS.get(color.lower().replace("grey", "gray"), color)
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", code):
        return None
    red, green, blue = (int(code[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def scene_text(objects: Sequence[PlacedObject], comment: str = "") -> str:
    """Return the text of a scene file; the same objects give the same text.

    Args:
        objects: the objects on the table.
        comment: one line about the origin of the file.
    """
    import yaml

    defaults = {entry.name: entry.default for entry in fields(PlacedObject)}
    rows = []
    for placed in objects:
        values = {key: getattr(placed, key) for key in ("name", *(key for key in KEYS if key != "name"))}
        rows.append({k: v for k, v in values.items() if k in ("x", "y", "yaw") or v != defaults[k]})
    body = yaml.safe_dump({"version": VERSION, "objects": rows}, sort_keys=False, allow_unicode=True, width=1000)
    return (f"# {comment}\n" if comment else "") + body


def write_scene(objects: Sequence[PlacedObject], path: Path, comment: str = "") -> None:
    """Write a scene file whole or not at all; folders on the way are made.

    Raises:
        OSError: if it cannot be written there.
    """
    write_whole(path, scene_text(objects, comment))
