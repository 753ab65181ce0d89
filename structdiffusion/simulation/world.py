"""The simulated table top: rigid objects under gravity, observed by a fixed depth camera.

Every world is a PyBullet client of its own, so several worlds can exist at once. Poses are `world_from_object` of the
object frame (z = 0 at the lowest point, origin under the footprint's centroid), although PyBullet uses inertial frames.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pybullet

from structdiffusion.geometry import pose_from_position_quaternion, quaternion_from_matrix
from structdiffusion.objects.model import ObjectModel, unique_names
from structdiffusion.observation import ObjectCloud, Scene, Table
from structdiffusion.simulation.bodies import MARGIN, add_object, add_table
from structdiffusion.simulation.depth_camera import VIEWS, CameraImage, DepthCamera, measured_depth
from structdiffusion.simulation.visible_points import MIN_POINTS, ObservationError, visible_points

TABLE = -1  # represents the table among indices of objects
TIME_STEP = 1.0 / 240.0
FALLEN = -0.02  # m: objects below this z are no longer on the table
# At rest: slower than 1 cm/s and 0.2 rad/s for a tenth of a second.
REST_SPEED, REST_SPIN, REST_SECONDS = 0.01, 0.2, 0.1
# Clients of closed worlds, emptied and kept for the next ones: to start one takes 13 ms, to empty one 1 ms.
_IDLE: list[int] = []
_MOST_IDLE = 2


class TabletopWorld:
    """A table with objects on it, in its own physics client; close it, or use it in a `with` block.

    Attributes:
        client: the PyBullet client id.
        table_body: the PyBullet body id of the table.
        bodies: the PyBullet body id of each object.
        models: the model of each object.
        table: the table top.
        ground: the whole surface that carries objects, `table` or larger.
        camera: the fixed depth camera.

    Args:
        models: the objects.
        world_from_objects: a pose (4, 4) for each of them.
        table: the table top's rectangle that structures are built on.
        camera: the camera that `look` and `observe` use.
        ground: the rectangle beyond which objects fall off, by default `table`; a measured one extends beyond the arm's
            reach.
    """

    def __init__(
        self,
        models: Sequence[ObjectModel] = (),
        world_from_objects: Sequence[np.ndarray] | np.ndarray = (),
        table: Table = Table(),
        camera: DepthCamera = DepthCamera(),
        ground: Table | None = None,
    ) -> None:
        if len(models) != len(world_from_objects):
            raise ValueError(f"{len(models)} objects need as many poses, got {len(world_from_objects)}")
        self.client = _IDLE.pop() if _IDLE else pybullet.connect(pybullet.DIRECT)
        if self.client < 0:
            raise RuntimeError("PyBullet could not start a physics client; close other worlds first")
        self._here = {"physicsClientId": self.client}
        self.table = table
        self.ground = table if ground is None else ground
        self.camera = camera
        self.models: list[ObjectModel] = []
        self.bodies: list[int] = []
        self._object_from_inertial: list[np.ndarray] = []
        self._held: set[int] = set()  # bodies
        pybullet.setGravity(0.0, 0.0, -9.81, **self._here)
        # Contacts take most of the time; with these settings towers creep by less than 0.5 mm in 2 s.
        solver = {"numSolverIterations": 50, "solverResidualThreshold": 1e-6, "deterministicOverlappingPairs": 1}
        pybullet.setPhysicsEngineParameter(fixedTimeStep=TIME_STEP, **solver, **self._here)
        self.table_body = add_table(self.client, self.ground)
        for model, pose in zip(models, world_from_objects):
            self.add(model, pose)

    def __enter__(self) -> TabletopWorld:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the physics client back; closing twice has no effect."""
        if self.client < 0:
            return
        if len(_IDLE) < _MOST_IDLE:
            pybullet.resetSimulation(**self._here)
            _IDLE.append(self.client)
        else:
            pybullet.disconnect(self.client)
        self.client = -1

    def add(self, model: ObjectModel, world_from_object: np.ndarray) -> int:
        """Add an object to the world, at rest at the pose (4, 4), and return its index."""
        body = add_object(self.client, model)
        self.models.append(model)
        self.bodies.append(body)
        self._object_from_inertial.append(model.mass_properties.object_from_inertial)
        self.set_pose(len(self.bodies) - 1, world_from_object)
        return len(self.bodies) - 1

    def reorder(self, order: Sequence[int]) -> None:
        """Renumber the objects: the object with index `order[i]` gets index `i`.

        Raises:
            ValueError: if `order` is no permutation.
        """
        if sorted(order) != list(range(len(self.bodies))):
            raise ValueError(f"{list(order)} is not a permutation of {len(self.bodies)} objects")
        self.models = [self.models[i] for i in order]
        self.bodies = [self.bodies[i] for i in order]
        self._object_from_inertial = [self._object_from_inertial[i] for i in order]

    def pose(self, index: int) -> np.ndarray:
        """Return the pose world_from_object (4, 4) of one object."""
        position, quaternion = pybullet.getBasePositionAndOrientation(self.bodies[index], **self._here)
        world_from_inertial = pose_from_position_quaternion(np.array(position), np.array(quaternion))
        return world_from_inertial @ np.linalg.inv(self._object_from_inertial[index])

    def poses(self) -> list[np.ndarray]:
        """Return the pose world_from_object (4, 4) of every object."""
        return [self.pose(i) for i in range(len(self.bodies))]

    def set_pose(self, index: int, world_from_object: np.ndarray) -> None:
        """Put an object at a pose (4, 4), at rest."""
        inertial = np.asarray(world_from_object) @ self._object_from_inertial[index]
        body = self.bodies[index]
        pybullet.resetBasePositionAndOrientation(
            body, inertial[:3, 3].tolist(), quaternion_from_matrix(inertial).tolist(), **self._here
        )
        pybullet.resetBaseVelocity(body, (0, 0, 0), (0, 0, 0), **self._here)

    def hold(self, index: int) -> None:
        """Keep an object where it is, whatever touches it or is below it, until it is freed."""
        pybullet.changeDynamics(self.bodies[index], -1, mass=0.0, **self._here)
        self._held.add(self.bodies[index])

    def free(self, body: int) -> None:
        """Let a body that was held move again; other bodies move anyway."""
        if body not in self._held:
            return
        self._held.remove(body)
        model = self.models[self.bodies.index(body)]
        inertia = model.mass_properties.inertia.tolist()
        pybullet.changeDynamics(body, -1, mass=model.mass, localInertiaDiagonal=inertia, **self._here)

    @property
    def held(self) -> list[int]:
        """Return the indices of the objects that are held."""
        return [index for index, body in enumerate(self.bodies) if body in self._held]

    def speeds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the speed of every object's centre of mass (N,) m/s, and its angular speed (N,) rad/s."""
        velocity = [pybullet.getBaseVelocity(body, **self._here) for body in self.bodies]
        both = np.linalg.norm(np.array(velocity).reshape(-1, 2, 3), axis=2)
        return both[:, 0], both[:, 1]

    def centers_of_mass(self) -> np.ndarray:
        """Return every object's centre of mass (N, 3), world frame."""
        frames = [pybullet.getBasePositionAndOrientation(body, **self._here) for body in self.bodies]
        return np.array([position for position, _ in frames]).reshape(-1, 3)

    def refine(self, iterations: int) -> None:
        """Let the engine's solver take so many iterations a step from now on."""
        pybullet.setPhysicsEngineParameter(numSolverIterations=iterations, **self._here)

    def step(self, seconds: float) -> None:
        """Run physics for `seconds`, rounded to whole steps of 1/240 s, at least one."""
        for _ in range(max(1, round(seconds / TIME_STEP))):
            pybullet.stepSimulation(**self._here)

    def settle(
        self, seconds: float = 1.5, watch: Callable[[np.ndarray], None] | None = None, until_rest: bool = True
    ) -> float:
        """Run physics for `seconds`, or until everything is at rest; return the simulated seconds.

        `watch` is called after each step with every object's speed (N,) in m/s.
        """
        still = 0
        for k in range(round(seconds / TIME_STEP)):
            self.step(TIME_STEP)
            speed, spin = self.speeds()
            if watch is not None:
                watch(speed)
            still = still + 1 if (speed < REST_SPEED).all() and (spin < REST_SPIN).all() else 0
            if until_rest and still * TIME_STEP >= REST_SECONDS:
                return (k + 1) * TIME_STEP
        return seconds

    def clearances(self, index: int, reach: float = 0.01, among: Sequence[int] | None = None) -> dict[int, float]:
        """Return signed distances, metres, from an object to everything within `reach`; negative is penetration.

        The keys are indices of other objects, and `TABLE`; `among` restricts them. Distances are between the exact
        convex parts, without the engine's margin.
        """
        found: dict[int, float] = {}
        for other, body in [(TABLE, self.table_body), *enumerate(self.bodies)]:
            if other == index or (among is not None and other not in among):
                continue
            closest = pybullet.getClosestPoints(self.bodies[index], body, reach, **self._here)
            if closest:
                margin = MARGIN if other == TABLE else 2 * MARGIN
                found[other] = min(point[8] for point in closest) + margin
        return found

    def supports(self, seconds: float = 0.1, share: float = 0.05) -> list[tuple[int, ...]]:
        """Return what each object rests on, as indices and `TABLE`; physics runs for `seconds` to find it.

        A body supports an object if the upward component of its contact forces, averaged over the time, is at least
        `share` of the object's weight.
        """
        index_of = {body: i for i, body in enumerate(self.bodies)} | {self.table_body: TABLE}
        steps = max(1, round(seconds / TIME_STEP))
        lift: Counter[tuple[int, int]] = Counter()
        for _ in range(steps):
            self.step(TIME_STEP)
            for contact in pybullet.getContactPoints(**self._here):
                if contact[1] not in index_of or contact[2] not in index_of:
                    continue
                upward = contact[7][2] * contact[9] / steps  # the normal points from B to A
                a, b = index_of[contact[1]], index_of[contact[2]]
                lift[(a, b)] += upward
                lift[(b, a)] -= upward
        carriers: list[tuple[int, ...]] = []
        for k, model in enumerate(self.models):
            enough = share * 9.81 * model.mass
            carriers.append(tuple(sorted(b for (a, b), force in lift.items() if a == k and force >= enough)))
        return carriers

    def _render(self, camera: DepthCamera, shadow: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        _, _, color, buffer, segmentation = pybullet.getCameraImage(
            camera.width,
            camera.height,
            camera.view_matrix,
            camera.projection_matrix,
            lightDirection=(0.6, 0.9, 2.0),
            shadow=int(shadow),
            renderer=pybullet.ER_TINY_RENDERER,
            **self._here,
        )
        size = (camera.height, camera.width)
        color = np.asarray(color, dtype=np.uint8).reshape(*size, 4)[..., :3]
        return color, np.asarray(buffer).reshape(size), np.asarray(segmentation).reshape(size)

    def look(self, rng: np.random.Generator | None = None, camera: DepthCamera | None = None) -> CameraImage:
        """Take a picture with the world's camera, or another; `rng` adds the sensor's noise, without it the picture is
        exact.
        """
        camera = self.camera if camera is None else camera
        color, buffer, segmentation = self._render(camera)
        depth = camera.depth_from_buffer(buffer)
        if rng is not None:
            depth = measured_depth(depth, rng)
        return CameraImage(color, depth, segmentation, camera.points(depth), camera.world_from_camera)

    def measure(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Return the depth (H, W), metres, and the points (H, W, 3), world frame, that `look` would measure now.

        The shadows of the colours, which are not drawn here, take two fifths of a picture's time.
        """
        depth = measured_depth(self.camera.depth_from_buffer(self._render(self.camera, shadow=False)[1]), rng)
        return depth, self.camera.points(depth)

    def observe(
        self,
        rng: np.random.Generator,
        objects: Sequence[int] | None = None,
        distractors: Sequence[int] = (),
        min_points: int = MIN_POINTS,
        names: Sequence[str] | None = None,
    ) -> Scene:
        """Observe the scene, segmented into partial clouds of at most 1024 points each.

        Args:
            rng: draws the sensor's noise and the subset of points.
            objects: the indices of the participants; by default all but the distractors.
            distractors: indices of the others; one that cannot be seen is left out.
            min_points: the number of points below which an object counts as hidden.
            names: unique names of the objects of this world; by default their nouns, numbered.

        Raises:
            ObservationError: if an object that takes part shows fewer than `min_points` points.
        """
        objects = [i for i in range(len(self.bodies)) if i not in distractors] if objects is None else objects
        image, names = self.look(rng), unique_names(self.models) if names is None else names

        def cloud(index: int) -> ObjectCloud | None:
            seen = visible_points(image, self.bodies[index], rng, min_points)
            return None if seen is None else ObjectCloud(names[index], self.models[index].category, *seen)

        clouds = [cloud(i) for i in objects]
        for index, found in zip(objects, clouds):
            if found is None:
                what = f"fewer than {min_points} points of the {names[index]}"
                raise ObservationError(f"the camera sees {what}: it is hidden or out of view")
        others = tuple(found for found in map(cloud, distractors) if found is not None)
        seen = tuple(found for found in clouds if found is not None)
        return Scene(seen, self.table, others, image.world_from_camera, image.color, self.camera.intrinsics)

    def picture(
        self,
        view: str = "robot",
        width: int = 640,
        height: int = 480,
        camera: DepthCamera | None = None,
    ) -> np.ndarray:
        """Render an RGB picture (height, width, 3) uint8.

        Args:
            view: "robot" (as this world's camera sees it), or another of
                `structdiffusion.simulation.depth_camera.VIEWS`.
            width, height: pixels.
            camera: the camera to use instead of the view's.

        Raises:
            ValueError: for an unknown view.
        """
        if view not in VIEWS:
            raise ValueError(f"unknown view {view!r}; legal views: {', '.join(VIEWS)}")
        lens = camera or (self.camera if view == "robot" else VIEWS[view])
        lens = replace(lens, width=width, height=height)
        return self._render(lens)[0]
