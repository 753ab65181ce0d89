"""Watch the place where an object is to go while the arm brings it there: somebody may put something else into it, or
take away what it was to stand on.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from shapely import MultiPoint, contains_xy, prepare

from agent.arm.object_planner import ObjectPlan
from agent.arm.placement_order import GOAL_CLEARANCE
from agent.arm.table_camera import ARM_MARGIN, TableCamera, in_box
from structdiffusion.geometry import transform_points
from structdiffusion.simulation.world import TIME_STEP

EVERY = round(0.4 / TIME_STEP)  # steps between two pictures: nobody brings anything and takes it away in that time
NEARER = 0.015  # m by which a pixel is nearer or farther than in the last picture: seven times the camera's noise
LEAST_PIXELS = 100  # 2 cm by 2 cm, more than the edges of what stands there change
HEADROOM = 0.1  # m above the object at its goal, through which it is lowered


class PlaceWatch:
    """A watch over the place of the object in the hand; call it after every physics step, until it is blocked.

    It compares pictures with the last one that was taken while the arm was out of view. What the arm hides, or the
    object in the hand, is not known.

    Args:
        camera: takes the pictures.
        plan: of the object in the hand.
        solid: (P, 3) the object with its hidden sides where it was taken, world frame, metres.

    Attributes:
        blocked: whether something has come to the place, or what was to carry the object is gone from it.
    """

    def __init__(self, camera: TableCamera, plan: ObjectPlan, solid: np.ndarray) -> None:
        self._camera, self.blocked, self._steps = camera, False, 0
        held = transform_points(np.linalg.inv(plan.grasp.world_from_ee), solid)
        self._held = cKDTree(held)
        # What hangs from its rim swings about the fingers.
        self._swings = float(np.linalg.norm(held, axis=1).max()) if plan.grasp.kind == "rim" else 0.0
        self._taken = cKDTree(solid)
        goal = transform_points(plan.goal_from_now, solid)
        self._outline = MultiPoint(goal[:, :2]).convex_hull.buffer(GOAL_CLEARANCE)
        prepare(self._outline)
        self._corners = np.stack((goal.min(axis=0), goal.max(axis=0)))
        self._corners += np.array([[-GOAL_CLEARANCE] * 3, [GOAL_CLEARANCE] * 2 + [HEADROOM]])

    def __call__(self) -> bool:
        """Look, if it is time to; return whether the object cannot be put there any more."""
        if not self.blocked and self._steps % EVERY == 0:
            now, before, nearer = self._camera.glance()
            changed = self._come(now, nearer), self._gone(before, nearer)
            self.blocked = max(map(len, changed)) >= LEAST_PIXELS
        self._steps += 1
        return self.blocked

    def _there(self, points: np.ndarray, which: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Return the chosen ones (H, W) of points (H, W, 3) that are over the place, in a box with corners (2, 3)."""
        found = points[which]
        found = found[in_box(found, corners)]
        return found[contains_xy(self._outline, found[:, :2])]

    def _come(self, now: np.ndarray, nearer: np.ndarray) -> np.ndarray:
        """Return the points (P, 3) that are at the place now and were not before."""
        points = self._there(now, nearer > NEARER, self._corners)
        if len(points):
            in_hand = transform_points(np.linalg.inv(self._camera.world_from_ee()), points)
            own = (self._held.query(in_hand)[0] < ARM_MARGIN) | (np.linalg.norm(in_hand, axis=1) < self._swings)
            points = points[~own]
        return points[self._camera.off_arm(points)]

    def _gone(self, before: np.ndarray, nearer: np.ndarray) -> np.ndarray:
        """Return the points (P, 3) of what was to carry the object that were there and are not now."""
        low, high = self._corners
        if low[2] < 0.0:
            return np.empty((0, 3))  # the table carries it
        top = np.stack((low, [*high[:2], low[2] + 2 * GOAL_CLEARANCE]))
        points = self._there(before, nearer < -NEARER, top)
        return points[self._taken.query(points)[0] > GOAL_CLEARANCE] if len(points) else points
