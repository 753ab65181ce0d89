"""Keep the turns of a conversation as a tree: whoever goes back and says something else begins a branch, and every turn
stays reachable. The camera's pictures in them are kept compressed.
"""

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


@dataclass(frozen=True)
class TimelineTurn:
    """A turn of the timeline.

    Attributes:
        number: 0 for the start.
        after: the number of the turn that it follows; `None` for the start.
        branch: from 1; a turn that is not the first to follow another one begins a branch.
        line: what was said.
    """

    number: int = 0
    after: int | None = None
    branch: int = 1
    line: str = ""


@dataclass
class History:
    """The turns so far, each with the situation in which it was left; one of them is the present one.

    Attributes:
        turns: by number.
        present: the number of the present turn.
    """

    turns: list[TimelineTurn] = field(default_factory=lambda: [TimelineTurn()])
    present: int = 0
    _left: dict[int, _Kept] = field(default_factory=dict)
    _undone: list[int] = field(default_factory=list)
    _forks: bool = False

    @property
    def last_poses(self) -> dict[str, np.ndarray] | None:
        """Return the poses (4, 4) by name to which an undo returns; `None` if there is no earlier turn."""
        before = self.turns[self.present].after
        return None if before is None else dict(self._left[before].situation.poses)

    def remember(self, situation: Situation, line: str = "") -> TimelineTurn:
        """Begin a turn, and keep the situation that ends the one before; what was undone cannot be done again then."""
        before = self.turns[self.present]
        follows = any(turn.after == before.number for turn in self.turns)
        branch = max(turn.branch for turn in self.turns) + 1 if follows or self._forks else before.branch
        turn = TimelineTurn(len(self.turns), before.number, branch, line)
        self.turns.append(turn)
        self._left[before.number] = _kept(situation)
        self.present, self._forks = turn.number, False
        self._undone.clear()
        return turn

    def forget_undone(self) -> None:
        """Let what was undone be done again by its number alone."""
        self._undone.clear()

    def undo(self, present: Situation) -> Situation | None:
        """Return the situation one turn ago; `None` if there is none."""
        number, before = self.present, self.turns[self.present].after
        if before is None:
            return None
        undone = [*self._undone, number]
        situation = self.go_to(before, present)
        self._undone = undone
        return situation

    def redo(self, present: Situation) -> Situation | None:
        """Return the situation that the last undo left; `None` if there is none."""
        if not self._undone:
            return None
        *undone, number = self._undone
        situation = self.go_to(number, present)
        self._undone = undone
        return situation

    def go_to(self, number: int, present: Situation) -> Situation:
        """Return the situation in which a turn was left, which is the present one from now on.

        Args:
            number: of the turn.
            present: the situation that is left now.
        """
        self._left[self.present] = _kept(present)
        self.present, self._forks = number, False
        self._undone.clear()
        return _restored(self._left[number])

    def fork(self) -> int:
        """Let the next turn begin a branch; return the number of the branch."""
        self._forks = True
        return max(turn.branch for turn in self.turns) + 1

    def situation_of(self, number: int, present: Situation) -> Situation:
        """Return the situation in which a turn was left, without pictures; `present` is that of the present turn."""
        return present if number == self.present else self._left[number].situation


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
