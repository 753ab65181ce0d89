"""Lay proposed structures around an object that takes part but cannot be moved, such as a plate that no hand can hold.

What a structure is does not depend on where it lies: each is moved as a whole until the object is where it stands.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate
from structdiffusion.geometry import pose_from_xyz_yaw, yaw_of
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.structures.structure import LayoutError

# A failed check halves the score of the checks at least (`ranking.checks_scores`).
_HOLDS = 0.5


def anchor(
    objects: Sequence[ObjectEstimate],
    motions: np.ndarray,
    frames: np.ndarray,
    spec: StructureSpec,
    fixed: Sequence[int],
) -> tuple[np.ndarray, np.ndarray]:
    """Move structures so that the first of the fixed objects stays; whether the others can too is for the checks to
    tell.

    Where no rotation is asked for, every second structure is turned too, so that the object keeps its own rotation.

    Args:
        objects: N estimates.
        motions: (K, N, 4, 4) upright motions, world frame.
        frames: (K, 4, 4) world_from_structure.
        spec: the requested slots.
        fixed: the indices of the objects that stay; with none, nothing changes.

    Returns:
        The motions, the identity for each fixed object, and the frames.
    """
    if not fixed:
        return motions, frames
    motions, frames = motions.copy(), frames.copy()
    here = np.append(objects[fixed[0]].mean, 1.0)
    for k, motion in enumerate(motions):
        turned = k % 2 and spec.rotation is None
        whole = pose_from_xyz_yaw(0.0, 0.0, 0.0, -yaw_of(motion[fixed[0]]) if turned else 0.0)
        whole[:2, 3] = (here - whole @ motion[fixed[0]] @ here)[:2]
        motions[k], frames[k] = whole @ motion, whole @ frames[k]
    motions[:, list(fixed)] = np.eye(4)
    return motions, frames


def those_as_asked(arrangements: Sequence[Arrangement], scene: Scene) -> list[Arrangement]:
    """Return the arrangements that are as asked around the objects that stay: no other place makes up for it.

    Raises:
        LayoutError: if there is none; the message names the objects that stay.
    """
    found = [one for one in arrangements if not scene.fixed or one.scores.get("checks", 1.0) >= _HOLDS]
    if arrangements and not found:
        names = " and ".join(f"the {scene.objects[index].name}" for index in scene.fixed)
        raise LayoutError(f"no grasp fits {names}, and the goal cannot be built around it")
    return found
