"""Open pictures whose size is checked before their pixels are unpacked."""

from __future__ import annotations

import io
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import BadInput, one_sentence
from agent.recordings.sizes import check_pixels
from structdiffusion.limits import PICTURE_BYTES, read_at_most

_BEGINNINGS = {"PNG": (b"\x89PNG\r\n\x1a\n",), "JPEG": (b"\xff\xd8\xff",), "TIFF": (b"II*\0", b"MM\0*")}
_SCAN = b"\xff\xda"  # begins a scan of a JPEG; it cannot stand within one
_MOST_SCANS = 100  # progressive pictures have about ten; each goes over every pixel again


def open_picture(data: bytes, kinds: Collection[str]) -> Any:
    """Return the picture in `data`, whose pixels are not unpacked yet.

    The library's own limit is not asked, which for some sizes only warns.

    Args:
        data: of a whole file.
        kinds: of "PNG", "JPEG" and "TIFF".

    Raises:
        BadInput: for any other picture, a damaged one, or one with too many pixels.
    """
    from PIL.JpegImagePlugin import JpegImageFile
    from PIL.PngImagePlugin import PngImageFile
    from PIL.TiffImagePlugin import TiffImageFile

    openers: dict[str, Any] = {"PNG": PngImageFile, "JPEG": JpegImageFile, "TIFF": TiffImageFile}
    kind = next((kind for kind in kinds if data.startswith(_BEGINNINGS[kind])), None)
    if kind is None:
        raise BadInput(f"it is {'neither ' if len(kinds) > 1 else 'no '}{' nor '.join(kinds)}")
    if kind == "JPEG" and data.count(_SCAN) > _MOST_SCANS:
        raise BadInput(f"it has {data.count(_SCAN)} scans; at most {_MOST_SCANS} are read")
    try:
        picture = openers[kind](io.BytesIO(data))
    except Exception as error:  # the library promises no kind of error for damaged data
        raise BadInput(f"the header of the {kind} is damaged") from error
    check_pixels(*picture.size)
    return picture


def pixels_of(picture: Any, mode: str = "") -> np.ndarray:
    """Return the pixels of an open picture, converted to a mode such as "RGB" if one is given.

    Raises:
        BadInput: if it is damaged.
    """
    try:
        picture.load()
        return np.array(picture.convert(mode) if mode else picture)
    except Exception as error:  # as above
        raise BadInput(f"it is damaged: {one_sentence(error)}") from error


def read_picture(path: Path, kinds: Collection[str]) -> Any:
    """Return the picture in a file, as `open_picture` does.

    Raises: as `open_picture`, and `OSError`, also for a file of more bytes than any picture has.
    """
    return open_picture(read_at_most(path, PICTURE_BYTES), kinds)
