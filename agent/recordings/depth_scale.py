"""Find out how many metres a unit of a bag's measurement is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, Message
from agent.recordings.depth_units import IN_BAGS, IN_CLOUDS, fitting_unit
from agent.recordings.image_decoding import StoredDepths, stored_compressed_depths, stored_depths
from agent.recordings.message_decoding import COMPRESSED, Lens, frame_name, stamp, stored_cloud
from agent.recordings.synchronization import around
from agent.recordings.tf_tree import TransformLoop, base_from_camera, read_frames
from agent.recordings.topic_selection import Choice


@dataclass(frozen=True)
class Scale:
    """The unit of a measurement.

    Attributes:
        unit: metres per stored unit; `None` for that of the encoding.
        notes: what was found out or corrected, a sentence each.
    """

    unit: float | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Stored:
    """A measurement in its own unit.

    Attributes:
        points: (H, W, 3) in stored units.
        unit: metres per unit by the encoding.
        note: what was corrected, or "".
        frame, stamp: the optical frame, and when it was measured, nanoseconds.
    """

    points: np.ndarray
    unit: float
    note: str
    frame: str
    stamp: int


def stored(choice: Choice, message: Any) -> StoredDepths:
    """Return the depths of a message of the chosen topic.

    Raises:
        BadInput: if it is no depth picture.
    """
    assert choice.depth is not None
    return stored_compressed_depths(message) if choice.depth.stream.type == COMPRESSED else stored_depths(message)


def points_of(depth: np.ndarray, lens: Lens) -> np.ndarray:
    """Return points (H, W, 3) of depths (H, W) in the same unit, in the optical frame."""
    height, width = depth.shape
    across, down = np.moveaxis(lens.scaled(width, height).rays(width, height), -1, 0)
    return np.stack((across * depth, down * depth, depth), axis=-1)


def scale_of(
    bag: Bag, choice: Choice, lens: Lens | None, moment: int, given: float | None, on_topic: Callable[..., Any]
) -> Scale:
    """Return the unit of what the chosen topic measures near a moment (nanoseconds).

    Args:
        given: metres per unit that the user says, or `None`.
        on_topic: calls a function; an error in it is raised with the topic.

    Raises:
        BadInput: if nothing can be read, or the unit is not certain.
    """
    stream = choice.source.stream

    def measured(message: Message) -> _Stored:
        decoded = bag.decoded(message)
        if choice.points is not None:
            points, _, note = stored_cloud(decoded)
            unit = 1.0
        else:
            assert lens is not None
            depth = stored(choice, decoded)
            points, unit, note = points_of(depth.values, lens), depth.unit, depth.note
        if not (np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1)).any():
            raise BadInput("a picture measures nothing: it has no valid point")
        when = stamp(decoded.header, message.recorded)
        return _Stored(points, unit, note, frame_name(decoded.header.frame_id), when)

    found = around(bag, stream, moment, lambda message: on_topic(stream, lambda: measured(message)), before=1, after=1)
    if not found:
        return Scale(given)
    seen = found[0].value
    notes = (f"{stream.topic}: {seen.note}: they were taken so",) if seen.note else ()
    if given is not None:
        return Scale(given, notes)

    def base() -> np.ndarray | None:
        try:
            return base_from_camera(read_frames(bag, seen.stamp, [(seen.frame, "")]), seen.frame, "")[0]
        except TransformLoop:
            return None

    candidates, what = (IN_CLOUDS, "coordinates") if choice.points is not None else (IN_BAGS, "depths")
    unit, said = fitting_unit(seen.points, seen.unit, candidates, f"the {what} on {stream.topic}", base)
    return Scale(unit, (*notes, said) if said else notes)
