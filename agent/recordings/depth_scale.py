"""Find out how many metres a unit of a bag's measurement is."""

from __future__ import annotations

from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag
from agent.recordings.depth_units import IN_BAGS, IN_CLOUDS, fitting_unit
from agent.recordings.image_decoding import StoredDepths, stored_compressed_depths, stored_depths
from agent.recordings.message_decoding import COMPRESSED, frame_name, stamp
from agent.recordings.tf_tree import TransformLoop, base_from_camera, read_frames
from agent.recordings.topic_selection import Choice


class ScaleFinder:
    """The unit of what a topic measures, decided by the first message that measures something.

    Args:
        bag: open.
        choice: whose source is read.
        given: metres per unit that the user says, or `None`.

    Attributes:
        unit: metres per stored unit; `None` until it is decided.
        notes: what was found out or corrected, a sentence each.
    """

    def __init__(self, bag: Bag, choice: Choice, given: float | None) -> None:
        self._bag, self._choice, self._given = bag, choice, given
        self.unit: float | None = None
        self.notes: tuple[str, ...] = ()
        self._problem: BadInput | None = None

    def unit_of(self, points: np.ndarray, declared: float, corrected: str, header: Any, recorded: int) -> float:
        """Return the unit of a measurement.

        Args:
            points: (..., 3) in stored units, the camera at the origin; those of a message that measures nothing decide
                nothing.
            declared: metres per unit by the encoding.
            corrected: what was corrected in the message, or "".
            header: of the message. recorded: when it was recorded, nanoseconds.

        Raises:
            BadInput: if the unit is not certain.
        """
        if self._problem is not None:  # another message would tell no more
            raise self._problem
        if self.unit is not None:
            return self.unit
        there = np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1)
        if not there.any():
            return declared
        topic = self._choice.source.stream.topic
        notes = (f"on {topic}, {corrected}: they were taken so",) if corrected else ()
        if self._given is not None:
            self.unit, self.notes = self._given, notes
            return self._given
        frame = frame_name(header.frame_id)

        def base() -> np.ndarray | None:
            try:
                frames = read_frames(self._bag, stamp(header, recorded), [(frame, "")])
                return base_from_camera(frames, frame, "")[0]
            except TransformLoop:
                return None

        of_cloud = self._choice.points is not None
        what = f"the {'coordinates' if of_cloud else 'depths'} on {topic}"
        try:
            unit, said = fitting_unit(points, declared, IN_CLOUDS if of_cloud else IN_BAGS, what, base)
        except BadInput as error:
            self._problem = error
            raise
        self.unit, self.notes = unit, (*notes, said) if said else notes
        return unit


def stored(choice: Choice, message: Any) -> StoredDepths:
    """Return the depths of a message of the chosen topic.

    Raises:
        BadInput: if it is no depth picture.
    """
    assert choice.depth is not None
    return stored_compressed_depths(message) if choice.depth.stream.type == COMPRESSED else stored_depths(message)
