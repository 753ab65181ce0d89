"""One episode: a scene of the benchmark, changed by picks and goal poses, and judged by the evaluation protocol.

In the mode "place" an object is released above its goal, as in the physical protocol, but with everything else on the
table. In the mode "arm" the arm picks and places it.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from agent.pipeline.verdict import judge_built
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.evaluation_protocol import (
    ABNORMAL_VELOCITY,
    INTERSECTION,
    MAX_PENETRATION,
    MAX_SPEED,
    NOT_UPRIGHT,
    RELEASE_HEIGHT,
    SETTLE_SECONDS,
)
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.model import unique_names
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.protocol.standing import standing
from structdiffusion.simulation.depth_camera import CameraImage
from structdiffusion.simulation.visible_points import visible_points
from structdiffusion.simulation.world import FALLEN, TABLE, TabletopWorld
from structdiffusion.structures.checks import Check

MODES = ("place", "arm")
OTHERS = "objects that take no part and are off their places"  # the name of the check
_ON_TABLE = 0.005  # m: an object that is lower stands on the table


@dataclass(frozen=True)
class Move:
    """A pick, and the pose at which the object is put down.

    Attributes:
        object: its index among the objects that are seen.
        x, y: where the middle of what was last seen of it goes, world frame, metres.
        z: the height of what it is put on, metres; 0 is the table.
        yaw: by which it is turned about the vertical, radians.
    """

    object: int
    x: float
    y: float
    z: float
    yaw: float


@dataclass(frozen=True)
class Outcome:
    """What became of a move.

    Attributes:
        failure: the class of failure of the evaluation protocol, or `None` if everything stands as asked.
        detail: it in a sentence.
        checks: all checks of the protocol; empty after an intersection or a fast object.
        ended: whether the episode is over: everything stands as asked, or it has failed for good.
        refused: why nothing was moved; empty if something was.
    """

    failure: str | None
    detail: str
    checks: tuple[Check, ...] = ()
    ended: bool = False
    refused: str = ""

    @property
    def success(self) -> bool:
        """Return whether everything stands as asked."""
        return self.failure is None


@dataclass(frozen=True, eq=False)
class Seen:
    """What the camera shows of the table.

    Attributes:
        image: the picture, with the sensor's noise in its depth.
        clouds: for each object of the scene what is seen of it, or `None`.
        positions: (M, 3) of each object the middle of what is seen of it, x and y, and the height of what it stands on,
            world frame, metres; NaN for what is not seen.
    """

    image: CameraImage
    clouds: tuple[ObjectCloud | None, ...]
    positions: np.ndarray


class Episode:
    """The table of one scene. Close it, or use it in a `with` block.

    Args:
        scene: the scene; its first objects take part, the others stay where they are.
        mode: one of `MODES`.
        hold: how the arm's hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.

    Attributes:
        scene: the scene.
        names: what the objects are called.
    """

    def __init__(self, scene: EvaluationScene, mode: str = "place", hold: str = "friction") -> None:
        drawn = scene.drawn
        self.scene, self.mode, self.hold = scene, mode, hold
        self.names = unique_names(drawn.models)
        self._expected = [np.array(pose) for pose in drawn.world_from_initial]
        self._rng = np.random.default_rng(scene.planning_seed)
        self._world = TabletopWorld(drawn.models, list(drawn.world_from_initial), drawn.table, scene.camera)
        self._arm = None
        if mode == "arm":
            from agent.arm.simulated_arm import SimulatedArm

            self._arm = SimulatedArm(self._world.client)
            self._arm.hold_by(hold)
        self._seen = self.look()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Give the physics client back; closing twice has no effect."""
        self._world.close()

    @property
    def count(self) -> int:
        """Return how many of the objects take part: the first ones."""
        return self.scene.drawn.count

    @property
    def bodies(self) -> tuple[int, ...]:
        """Return the number of each object in the segmentation of a picture."""
        return tuple(self._world.bodies)

    def look(self) -> Seen:
        """Take a picture; moves refer to the last one."""
        image, positions = self._world.look(self._rng), np.full((len(self.names), 3), np.nan)
        clouds = list[ObjectCloud | None]()
        for index, (body, model) in enumerate(zip(self._world.bodies, self._world.models, strict=True)):
            bottom = self._bottom(index)
            found = None if bottom < FALLEN else visible_points(image, body, self._rng)
            if found is None:
                clouds.append(None)
                continue
            clouds.append(ObjectCloud(self.names[index], model.category, *found, bottom if bottom > _ON_TABLE else 0.0))
            positions[index] = (*found[0].mean(axis=0)[:2], max(bottom, 0.0))
        self._seen = Seen(image, tuple(clouds), positions)
        return self._seen

    def picture(self) -> np.ndarray:
        """Return a picture (480, 640, 3) uint8 of the table, and of the arm if there is one."""
        return self._world.picture("beside" if self._arm is not None else "robot")

    def move(self, move: Move) -> Outcome:
        """Carry out a move, and judge the table."""
        refusal = self._refusal(move.object)
        if refusal:
            return self._judged(refusal)
        index, (x, y, z) = move.object, self._seen.positions[move.object]
        goal_from_now = pose_from_xyz_yaw(move.x, move.y, move.z - z, move.yaw)
        goal_from_now[:2, 3] -= goal_from_now[:2, :2] @ (x, y)
        if self.mode == "arm":
            return self._judged(self._build(index, goal_from_now))
        return self._release(index, goal_from_now @ self._world.pose(index))

    def _refusal(self, index: int) -> str:
        if index >= len(self.names):
            return f"there is no object {index}; legal: 0 to {self.count - 1}"
        if index >= self.count:
            return f"the {self.names[index]} takes no part; legal: 0 to {self.count - 1}"
        return f"the {self.names[index]} is not seen" if self._seen.clouds[index] is None else ""

    def _bottom(self, index: int) -> float:
        points = transform_points(self._world.pose(index), np.concatenate(self._world.models[index].hulls))
        return float(points[:, 2].min())

    def _release(self, index: int, goal: np.ndarray) -> Outcome:
        """Release an object 3 cm above its goal (4, 4), where it may penetrate nothing, and judge the table."""
        world, name, before = self._world, self.names[index], self._world.pose(index)
        world.set_pose(index, goal)
        for other, clearance in world.clearances(index).items():
            if clearance < -MAX_PENETRATION:
                world.set_pose(index, before)
                thing = "table" if other == TABLE else self.names[other]
                return Outcome(INTERSECTION, f"the {name} would penetrate the {thing} by {-clearance:.4f} m", (), True)
        above = goal.copy()
        above[2, 3] += RELEASE_HEIGHT
        world.set_pose(index, above)
        fastest = np.zeros(len(self.names))

        def watch(speeds: np.ndarray) -> None:
            np.maximum(fastest, speeds, out=fastest)

        world.settle(SETTLE_SECONDS, watch)
        if fastest.max() > MAX_SPEED:
            return Outcome(
                ABNORMAL_VELOCITY, f"the {self.names[int(fastest.argmax())]} moves at {fastest.max():.2f} m/s", (), True
            )
        self._expected[index] = goal
        return self._judged()

    def _build(self, index: int, goal_from_now: np.ndarray) -> str:
        """Let the arm move an object by a motion (4, 4); return why it cannot, or an empty text."""
        from agent.environment.arm_move import carry_out

        seen = [number for number in range(self.count) if self._seen.clouds[number] is not None]
        own = [cloud for cloud in self._seen.clouds[: self.count] if cloud is not None]
        others = [cloud for cloud in self._seen.clouds[self.count :] if cloud is not None]
        scene = Scene(
            tuple(own), self.scene.drawn.table, tuple(others),
            self._seen.image.world_from_camera, self._seen.image.color, self.scene.camera.intrinsics,
        )  # fmt: skip
        assert self._arm is not None
        goal = goal_from_now @ self._world.pose(index)
        done = carry_out(self._world, self._arm, scene, seen.index(index), goal_from_now, self._rng)
        if done.placed:
            self._expected[index] = goal
        for place in done.set_aside:
            self._expected[seen[place]] = self._world.pose(seen[place])
        return done.refused

    def _judged(self, refused: str = "") -> Outcome:
        """Judge the table after 2 s at rest."""
        world, goals, count = self._world, np.array(self._expected), self.count
        failure, checks = judge_built(world, range(count), goals[:count], self.scene.spec)
        ways = [standing(world, index, goals[index]) for index in range(count, len(goals))]
        off = sum(not way.stands for way in ways)
        checks = (*checks, Check(OTHERS, off == 0, off, "0"))
        if off and failure not in (ABNORMAL_VELOCITY, NOT_UPRIGHT):
            failure = ABNORMAL_VELOCITY
        wrong = next((check for check in checks if not check.passed), None)
        detail = wrong.sentence if wrong else "everything stands as asked"
        fallen = any(world.pose(index)[2, 3] < FALLEN for index in range(len(goals)))
        lost = fallen if self.mode == "arm" else failure in (ABNORMAL_VELOCITY, NOT_UPRIGHT)
        return Outcome(failure, detail, checks, failure is None or lost, refused)
