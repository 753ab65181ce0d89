"""Keep the situations to which "undo" and "redo" return; the camera's pictures in them are kept compressed."""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace

import numpy as np
from PIL import Image

from agent.chat.state import Proposal, Situation
from structdiffusion.observation import Scene

_EFFORT = 3  # of the compression, 0 to 9: a picture of 0.9 MB takes some 15 ms and 20 kB


@dataclass(frozen=True)
class _Kept:
    """A situation whose proposals have no pictures, and these as PNG files."""

    situation: Situation
    pictures: tuple[bytes | None, bytes | None]


@dataclass
class History:
    """The situations before the present one, and those that were undone, the latest last."""

    _past: list[_Kept] = field(default_factory=list)
    _future: list[_Kept] = field(default_factory=list)

    @property
    def last_poses(self) -> dict[str, np.ndarray] | None:
        """Return the poses (4, 4) by name to which an undo returns; `None` if there is no earlier turn."""
        return dict(self._past[-1].situation.poses) if self._past else None

    def remember(self, situation: Situation) -> None:
        """Keep the situation that a new turn ends; what was undone cannot be done again then."""
        self._past.append(_kept(situation))
        self._future.clear()

    def forget_undone(self) -> None:
        """Drop what was undone."""
        self._future.clear()

    def undo(self, present: Situation) -> Situation | None:
        """Return the situation one turn ago; `None` if there is none."""
        return _exchange(present, self._past, self._future)

    def redo(self, present: Situation) -> Situation | None:
        """Return the situation that the last undo left; `None` if there is none."""
        return _exchange(present, self._future, self._past)


def _exchange(present: Situation, source: list[_Kept], other: list[_Kept]) -> Situation | None:
    if not source:
        return None
    other.append(_kept(present))
    return _restored(source.pop())


def _kept(situation: Situation) -> _Kept:
    """Return a situation as it is kept; a picture that both proposals have is kept once."""
    proposals = (situation.proposal, situation.shown)
    scenes = [None if one is None else one.scene for one in proposals]
    first = _packed(scenes[0])
    second = first if scenes[1] is scenes[0] else _packed(scenes[1])
    bare = [None if one is None else _with_picture(one, None) for one in proposals]
    if situation.shown is situation.proposal:
        bare[1] = bare[0]
    return _Kept(replace(situation, proposal=bare[0], shown=bare[1]), (first, second))


def _restored(kept: _Kept) -> Situation:
    situation, (first, second) = kept.situation, map(_unpacked, kept.pictures)
    proposal = situation.proposal and _with_picture(situation.proposal, first)
    if situation.shown is situation.proposal:
        return replace(situation, proposal=proposal, shown=proposal)
    return replace(situation, proposal=proposal, shown=situation.shown and _with_picture(situation.shown, second))


def _with_picture(proposal: Proposal, picture: np.ndarray | None) -> Proposal:
    scene = replace(proposal.scene, color=picture)
    return replace(proposal, scene=scene, proposed=replace(proposal.proposed, scene=scene))


def _packed(scene: Scene | None) -> bytes | None:
    if scene is None or scene.color is None:
        return None
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(scene.color)).save(buffer, format="PNG", compress_level=_EFFORT)
    return buffer.getvalue()


def _unpacked(content: bytes | None) -> np.ndarray | None:
    return None if content is None else np.asarray(Image.open(io.BytesIO(content)))
