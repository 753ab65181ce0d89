"""Write films as animated WebP files whose frames are complete pictures, so that each can be extracted unchanged.

A player then shows any of them at once; nothing is decoded or encoded again for that. The layout of the file is that of
the WebP container: RIFF, VP8X, ANIM, and an ANMF chunk per frame that holds the VP8 chunk of a picture.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence

import numpy as np
from PIL import Image

_ANIMATED = 0x02  # the flag of VP8X
_ON_TOP = 0x02  # a frame replaces what was there, and is not blended with it


def animation(frames: np.ndarray, durations: Sequence[int], quality: int) -> bytes:
    """Encode pictures (T, H, W, 3) uint8 as an animated WebP file that plays again and again.

    Args:
        frames: the pictures.
        durations: how long each is shown, ms.
        quality: of the pictures, 0 to 100.
    """
    height, width = frames.shape[1:3]
    size = (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(3, "little")
    parts = [
        _chunk(b"VP8X", bytes((_ANIMATED, 0, 0, 0)) + size),
        _chunk(b"ANIM", bytes(4) + struct.pack("<H", 0)),  # no background, endless
    ]
    for frame, duration in zip(frames, durations, strict=True):
        head = bytes(6) + size + duration.to_bytes(3, "little") + bytes((_ON_TOP,))
        parts.append(_chunk(b"ANMF", head + _picture_chunk(frame, quality)))
    return _file(b"".join(parts))


def still_frames(content: bytes) -> list[bytes] | None:
    """Extract the frames of an animated WebP file, each as a WebP file of its own.

    Returns:
        `None` if they are not complete pictures, as in films by other programs.
    """
    chunks = list(_chunks(content[12:]))
    frames = [body for name, body in chunks if name == b"ANMF"]
    canvas = next((body[4:10] for name, body in chunks if name == b"VP8X"), None)
    stills = []
    for body in frames:
        inner = list(_chunks(body[16:]))
        if body[:6] != bytes(6) or body[6:12] != canvas or [name for name, _ in inner] != [b"VP8 "]:
            return None
        stills.append(_file(_chunk(*inner[0])))
    return stills or None


def _picture_chunk(frame: np.ndarray, quality: int) -> bytes:
    buffer = io.BytesIO()
    picture = Image.fromarray(np.ascontiguousarray(frame[..., :3]))
    picture.save(buffer, format="WEBP", quality=quality, method=2)
    return next(_chunk(name, body) for name, body in _chunks(buffer.getvalue()[12:]) if name == b"VP8 ")


def _file(content: bytes) -> bytes:
    return b"RIFF" + struct.pack("<I", 4 + len(content)) + b"WEBP" + content


def _chunk(name: bytes, body: bytes) -> bytes:
    return name + struct.pack("<I", len(body)) + body + bytes(len(body) % 2)


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at + 8 <= len(content):
        name, (length,) = content[at : at + 4], struct.unpack("<I", content[at + 4 : at + 8])
        yield name, content[at + 8 : at + 8 + length]
        at += 8 + length + length % 2
