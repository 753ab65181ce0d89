"""Simulate a table with objects at rest and the arm beside it, seen by the depth camera."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType, TracebackType
from typing import Self

import numpy as np

from agent.arm.interference import keep_away
from agent.arm.recorded_state import stand
from agent.arm.recovery import AT_HOME, is_folded, tidy_up
from agent.arm.simulated_arm import SimulatedArm
from agent.scenes.film_camera import FilmCamera
from agent.scenes.object_attributes import attributes_at, attributes_of
from agent.scenes.object_placement import lowest_point
from agent.scenes.renaming import renamed
from agent.scenes.workcell import Workcell
from grounding.resolve.attributes import ObjectAttributes, SceneObject
from structdiffusion.geometry import tilt_between, transform_points
from structdiffusion.objects.model import ObjectModel, unique_names
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.simulation.world import FALLEN, TabletopWorld

MOVED = 0.002  # m, and of a rotation's entries: less is how things settle while others are moved
_LEAST_STEP = 0.003  # m: what was lifted by less still stands on the table
_STILL_STANDS = math.radians(10.0)  # what was tilted by more is looked at again: another side of it is up


@dataclass(frozen=True)
class _Seen:
    """An object as it was seen first, standing on the table, and its pose (4, 4) then."""

    cloud: ObjectCloud
    pose: np.ndarray


class TableScene:
    """A table that the pipeline can look at and work on; use it in a `with` block, which ends its physics.

    Args:
        models: the objects, participants first.
        world_from_initial: (M, 4, 4) their poses.
        count: how many take part.
        noise: draws the sensor's noise.
        workcell: the table, the camera and the arm.
        names: the unique names of the objects; by default their nouns, numbered.
        display_names: what an instruction can call them; by default their names.
        attributes: their colours and sizes; by default those of the models.

    Attributes:
        models, world_from_initial, count, names, display_names: as given.
        referents: the objects, as an instruction can refer to them.
        out_of_reach: name -> why the arm cannot take an object.
        missing: name -> why an object that was asked for takes no part.
        notes: what had to be assumed of the table and the arm, a sentence each.
        supposed: the names of the objects of which the camera does not see what they stand on.
        confidences: name -> confidence in its noun, of the objects whose nouns come from the picture.
        labelled: a picture (H, W, 3) uint8 with the objects marked and named, or `None`.
        bodies: a description of the bodies: "the true objects", or the completed bodies of a recording.
        world: the physics that the arm acts in, its bodies in the same order.
        arm: the arm.
        prefix: the prefix of the driver's joint names.
    """

    out_of_reach: Mapping[str, str] = MappingProxyType({})
    missing: Mapping[str, str] = MappingProxyType({})
    notes: tuple[str, ...] = ()
    supposed: frozenset[str] = frozenset()
    confidences: Mapping[str, float] = MappingProxyType({})
    labelled: np.ndarray | None = None
    bodies: str = "the true objects"

    def __init__(
        self,
        models: Sequence[ObjectModel],
        world_from_initial: np.ndarray,
        count: int,
        noise: np.random.Generator,
        workcell: Workcell = Workcell(),
        names: Sequence[str] | None = None,
        display_names: Sequence[str] | None = None,
        attributes: Sequence[ObjectAttributes] | None = None,
    ) -> None:
        self.models = tuple(models)
        self.world_from_initial = world_from_initial
        self.count = count
        self.names = tuple(unique_names(self.models) if names is None else names)
        self.display_names = tuple(self.names if display_names is None else display_names)
        self._attributes = tuple(map(attributes_of, self.models) if attributes is None else attributes)
        self._place = {name: place for place, name in enumerate(self.names)}
        self._noise = noise
        self._seen: dict[str, _Seen] = {}
        self.world = TabletopWorld(
            self.models, self.world_from_initial, workcell.table, workcell.camera, workcell.ground
        )
        arm = workcell.arm
        self.arm = SimulatedArm(self.world.client, workcell.kinematics)
        self.arm.stand_on(self.world.table_body)
        if arm is not None:
            self.notes += stand(self.arm, arm)
        self._stood = self.arm.configuration()
        self.prefix = f"{self.arm.model.name}_" if arm is None else arm.prefix

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.world.close()

    def look(self) -> Scene:
        """Return the camera's observation: the participants and the distractors.

        What was seen before and only moved since, upright, keeps the cloud of its first look: from a tower the camera
        sees little but the top. Where it is now is taken from the simulation's poses, as when the arm builds: this
        stands in for tracking. What has fallen over is looked at again, what has fallen off is left out.

        Raises:
            ObservationError: if the camera cannot see an object that takes part and was not seen before.
        """
        poses = dict(zip(self.names, self.world.poses(), strict=True))
        there = [i for i, name in enumerate(self.names) if name not in self.fallen]
        known = self.known_clouds()
        unknown = [i for i in there if self.names[i] not in known]
        scene = self.world.observe(
            self._noise,
            objects=[i for i in unknown if i < self.count],
            distractors=[i for i in unknown if i >= self.count],
            names=self.names,
        )
        fresh = {cloud.name: cloud for cloud in (*scene.objects, *scene.distractors)}
        for name, cloud in fresh.items():
            fresh[name] = cloud = replace(cloud, bottom=self._bottom(self.names.index(name), poses[name]))
            self._seen[name] = _Seen(cloud, poses[name])
        clouds = {**known, **fresh}
        return replace(
            scene,
            objects=tuple(clouds[self.names[i]] for i in there if i < self.count),
            distractors=tuple(clouds[self.names[i]] for i in there if i >= self.count and self.names[i] in clouds),
        )

    def known_clouds(self, still_stands: float = _STILL_STANDS) -> dict[str, ObjectCloud]:
        """Return the clouds of the objects that were seen before, by name, in their present places, without another
        look; what was tilted by more than an angle (rad) since, or has fallen off, is left out."""
        poses = self.poses()
        moved = {name: _moved(seen, poses[name], still_stands) for name, seen in self._seen.items()}
        return {name: cloud for name, cloud in moved.items() if cloud is not None}

    def remembered(self) -> Scene:
        """Return the observation of the table as it is known without another look:
        for a moment when the arm is at work.
        """
        clouds = self.known_clouds(math.pi)
        taking = [name for name in self.names[: self.count] if name in clouds]
        others = [name for name in self.names[self.count :] if name in clouds]
        return Scene(tuple(clouds[name] for name in taking), self.world.table, tuple(clouds[name] for name in others))

    def _bottom(self, index: int, pose: np.ndarray) -> float:
        """Return z of the surface under an object at the pose, from its true shape: a scene file may stack objects."""
        lowest = float(pose[2, 3]) + lowest_point(self.models[index], pose)
        return lowest if lowest > _LEAST_STEP else 0.0

    def keep_away(self, model: ObjectModel) -> int:
        """Add an object that is not on the table yet, where nobody sees it; return its index in `world`, the last."""
        name = f"new {model.category}"
        while name in self.names:
            name = f"another {name}"
        index = keep_away(self.world, model)
        self.models, self.names = (*self.models, model), (*self.names, name)
        self.display_names, self._attributes = (*self.display_names, name), (*self._attributes, attributes_of(model))
        self._place[name] = index
        self.world_from_initial = np.concatenate((self.world_from_initial, self.world.pose(index)[None]))
        self.__dict__.pop("film_camera", None)  # it films what it knew of
        return index

    @property
    def fallen(self) -> tuple[str, ...]:
        """Return the names of the objects that are no longer on the table."""
        return tuple(name for name, pose in zip(self.names, self.world.poses(), strict=True) if pose[2, 3] < FALLEN)

    @property
    def untouched(self) -> bool:
        """Return whether every object is still in its first observed place."""
        poses = self.poses()
        return all(np.abs(poses[name] - seen.pose).max() <= MOVED for name, seen in self._seen.items())

    def remember(self, clouds: Mapping[str, ObjectCloud]) -> None:
        """Store clouds, by object name, as seen in the objects' present places."""
        poses = self.poses()
        self._seen |= {name: _Seen(cloud, poses[name]) for name, cloud in clouds.items()}

    def involve(self, names: Sequence[str]) -> None:
        """Set which objects take part from now on; they come first, in their original order.

        Raises:
            KeyError: for a name that there is not.
        """
        unknown = set(names) - set(self.names)
        if unknown:
            raise KeyError(f"there is no {sorted(unknown)[0]!r}; there are: {', '.join(self.names)}")
        order = sorted(range(len(self.names)), key=lambda i: (self.names[i] not in names, self._place[self.names[i]]))
        self.world.reorder(order)
        self.models = tuple(self.models[i] for i in order)
        self.names = tuple(self.names[i] for i in order)
        self.display_names = tuple(self.display_names[i] for i in order)
        self._attributes = tuple(self._attributes[i] for i in order)
        self.world_from_initial = self.world_from_initial[order]
        self.count = len(names)

    def call(self, words: Mapping[str, tuple[str, str, str]]) -> None:
        """Give objects other words: name -> its new name, what an instruction can call it, and its noun."""
        index_of = {name: index for index, name in enumerate(self.names)}
        models, display_names = list(self.models), list(self.display_names)
        for name, (_, display_name, noun) in words.items():
            display_names[index_of[name]] = display_name
            models[index_of[name]] = replace(models[index_of[name]], category=noun)
            if (seen := self._seen.get(name)) is not None:
                self._seen[name] = replace(seen, cloud=replace(seen.cloud, category=noun))
        self.models, self.display_names = tuple(models), tuple(display_names)
        self.confidences = {name: share for name, share in self.confidences.items() if name not in words}
        self._rename({name: new for name, (new, _, _) in words.items()})

    def _rename(self, names: Mapping[str, str]) -> None:
        """Give objects other names: old name -> new name."""
        self.names, self._place, self._seen, self.notes, self.out_of_reach, self.missing = renamed(
            (self.names, self._place, self._seen, self.notes, self.out_of_reach, self.missing), names
        )

    @property
    def original_names(self) -> tuple[str, ...]:
        """Return the names of all objects in their first order, independent of which take part."""
        return tuple(sorted(self.names, key=self._place.__getitem__))

    @property
    def referents(self) -> tuple[SceneObject, ...]:
        """Return the objects as referents of an instruction at their present places, in the order of `names`."""
        return tuple(
            SceneObject(name, attributes_at(attributes, pose))
            for name, attributes, pose in zip(self.display_names, self._attributes, self.world.poses(), strict=True)
        )

    def referents_of(self, names: Sequence[str]) -> list[SceneObject]:
        """Return these objects, in this order, as an instruction can refer to them."""
        referents = dict(zip(self.names, self.referents, strict=True))
        return [referents[name] for name in names]

    @property
    def color_names(self) -> tuple[str, ...]:
        """Return the name of each object's colour, empty if unknown."""
        return tuple(each.colors[0] if each.colors else "" for each in self._attributes)

    def poses(self) -> dict[str, np.ndarray]:
        """Return world_from_object (4, 4) of every object, by name."""
        return dict(zip(self.names, self.world.poses(), strict=True))

    def surfaces(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return the surface of every object by name: its present vertices (V, 3), world frame, and faces (F, 3)."""
        return {
            name: (transform_points(pose, model.mesh_vertices), model.mesh_faces)
            for name, model, pose in zip(self.names, self.models, self.world.poses(), strict=True)
        }

    @property
    def held(self) -> str | None:
        """Return the name of the object in the hand; between builds it is only held after the arm's final stop."""
        return None if self.arm.held is None else self.names[self.world.bodies.index(self.arm.held)]

    @property
    def tidy(self) -> bool:
        """Return whether the hand is empty, and the arm is folded or in its first configuration, from which a build may
        start.
        """
        stands = np.abs(self.arm.configuration() - self._stood).max() < AT_HOME
        return self.arm.held is None and (bool(stands) or is_folded(self.arm))

    def tidy_up(self) -> bool:
        """Let the arm set down what it holds and fold after its final stop; return whether that was necessary."""
        return not self.tidy and tidy_up(self.world, self.arm, np.random.default_rng(0))

    def moved_since(self, poses: Mapping[str, np.ndarray]) -> tuple[str, ...]:
        """Return the names of the objects that are not at their poses (4, 4) in `poses` any more."""
        return tuple(name for name, now in self.poses().items() if np.abs(now - poses[name]).max() > MOVED)

    def put_back(self, poses: Mapping[str, np.ndarray]) -> tuple[str, ...]:
        """Put every object at its pose in `poses`, at rest, and fold the arm. Return the names of the objects that had
        moved.
        """
        moved = self.moved_since(poses)
        for index, name in enumerate(self.names):
            self.world.set_pose(index, poses[name])
        self.arm.drop()
        self.arm.fold_at_once()
        return moved

    def picture(self, view: str = "robot") -> np.ndarray:
        """Return a picture (H, W, 3) uint8 of the table as it is now, as the camera sees it, or from another view."""
        return self.world.picture(view)

    @cached_property
    def film_camera(self) -> FilmCamera:
        """Return the camera that sees the arm at work."""
        return FilmCamera(self.world, self.arm, dict(zip(self.names, self.models, strict=True)), self.poses)


def _moved(seen: _Seen, pose: np.ndarray, still_stands: float) -> ObjectCloud | None:
    """Return the cloud in its present place; `None` if it was tilted by more than an angle, or is gone."""
    if tilt_between(pose, seen.pose) > still_stands or pose[2, 3] < FALLEN:
        return None
    motion = pose @ np.linalg.inv(seen.pose)
    bottom = seen.cloud.bottom + float(pose[2, 3] - seen.pose[2, 3])
    return replace(
        seen.cloud,
        points=transform_points(motion, seen.cloud.points).astype(np.float32),
        bottom=bottom if bottom > _LEAST_STEP else 0.0,
    )


def drawing_and_noise(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """Return the generators of the scene and of its sensor noise, both derived from the seed."""
    drawing, noise = (np.random.default_rng(part) for part in np.random.SeedSequence(seed).spawn(2))
    return drawing, noise
