"""Check a glTF file before a library reads it: how much it claims, what it needs, and which other files it names."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from structdiffusion.limits import GLTF_TEXT_BYTES, MESH_BYTES, MESH_FACES, MESH_NODES, read_at_most

FORMATS = (".glb", ".gltf")
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "MSFT_", "ADOBE_materials_")  # no shapes
_TRIANGLES = (4, 5)


def gltf_faces(path: Path) -> int:
    """Return the approximate number of faces in a glTF file's scene, each mesh counted as often as it is placed.

    A file of a kilobyte can place a mesh a million times, or claim numbers that are not in it.

    Raises:
        ValueError: for a file that is damaged, too large, or needs an extension that changes shapes; the message says
            which.
    """
    content = _text_of(path)
    try:
        needed = [name for name in content.get("extensionsRequired", []) if not name.startswith(_HARMLESS)]
        if needed:
            raise ValueError(f"it needs the extension {needed[0]}, which is not read: export it without compression")
        most = max((accessor["count"] for accessor in content.get("accessors", [])), default=0)
        if most > 3 * MESH_FACES:
            raise ValueError(f"it claims {most} numbers in one list; at most {3 * MESH_FACES} are read")
        faces = [
            sum(_primitive_faces(content, part) for part in mesh["primitives"]) for mesh in content.get("meshes", [])
        ]
        placed = [node["mesh"] for node in content.get("nodes", []) if "mesh" in node]
        total = max(sum(faces), sum(faces[mesh] for mesh in placed))
        if total <= MESH_FACES and len(placed) > MESH_NODES:
            raise ValueError(f"it places {len(placed)} meshes; at most {MESH_NODES} are read")
        return total
    except (LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("its text is damaged") from error


def _text_of(path: Path) -> dict[str, Any]:
    if path.suffix.lower() == ".gltf":
        return json.loads(read_at_most(path, MESH_BYTES))
    with path.open("rb") as file:
        header = file.read(20)
        if len(header) < 20 or header[:4] != b"glTF":
            raise ValueError("it does not begin as a .glb file does")
        (length,) = struct.unpack("<I", header[12:16])
        if length > GLTF_TEXT_BYTES:
            raise ValueError(f"its text has {length} bytes; at most {GLTF_TEXT_BYTES} are read")
        return json.loads(file.read(length))


def _primitive_faces(content: dict[str, Any], part: dict[str, Any]) -> int:
    if part.get("mode", 4) not in _TRIANGLES:
        return 0
    accessor = part["indices"] if "indices" in part else part["attributes"]["POSITION"]
    count = content["accessors"][accessor]["count"]
    points = content["accessors"][part["attributes"]["POSITION"]]["count"]
    if not (isinstance(count, int) and isinstance(points, int)):
        raise TypeError
    return max(count, points) // 3


class OwnFolder:
    """The files that a mesh file may name: those in its own folder and below it.

    A library asks for them by `resolver[name]`.

    Args:
        path: of the mesh file.
    """

    def __init__(self, path: Path) -> None:
        self._folder = path.parent

    def __getitem__(self, name: str) -> bytes:
        """Return a file's content.

        Raises:
            ValueError: for an address, an absolute path, a file outside the folder (links resolved), or one that is not
                there or too large.
        """
        parts = urlsplit(name)
        if parts.scheme or parts.netloc:
            kind = parts.scheme if len(parts.scheme) < 10 else "foreign"
            raise ValueError(f"it names an address ({kind}:) where only files of its own folder are read")
        root, file = self._folder.resolve(), (self._folder / unquote(name))
        if not file.resolve().is_relative_to(root):
            raise ValueError(f"it names the file {name!r}, and only files of its own folder are read")
        if not file.is_file():
            raise ValueError(f"it names the file {name!r}, which is not there")
        try:
            return read_at_most(file, MESH_BYTES)
        except OSError as error:
            raise ValueError(f"it names the file {name!r}, which cannot be read ({error.strerror})") from error
