"""Build a twin of a recorded scene: the objects that were seen, completed into bodies, and the recorded arm.

The first look returns the recording itself: its clouds and its picture. Later looks observe the twin, and the
clouds move along with its bodies.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.errors import BadInput, NotBuildable
from agent.perception.overlay import labelled_picture
from agent.perception.perceive import perceive
from agent.recordings.load import read_recording
from agent.recordings.recording import RecordedOptions
from agent.runtime.output_ownership import OwnFolder
from agent.scenes.files import PlacedObject
from agent.scenes.limits import check_count
from agent.scenes.object_attributes import attributes_at
from agent.scenes.object_placement import placement_of, saved_objects
from agent.scenes.recorded_nouns import doubts, how_to_name, taken_nouns
from agent.scenes.recorded_objects import UNKNOWN, RecordedObject, called, recorded_objects
from agent.scenes.renaming import renamed
from agent.scenes.table_scene import TableScene, drawing_and_noise
from agent.scenes.validation import StandingObject
from agent.scenes.workcell import Workcell
from grounding.resolve.attributes import SceneObject
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.geometry import tilt_between
from structdiffusion.objects.model import SURFACE_POINTS
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.simulation.depth_camera import camera_at

if TYPE_CHECKING:
    from grounding.interpretation import Interpretation

_MESHES = "meshes"  # the folder beside a saved scene file
_SETTLE_SECONDS = 2.0
_FELL = "fell off the table as the twin came to rest"
# m and radians: a body that moves farther while the twin comes to rest was completed badly.
_STAYS, _TILTED = 0.01, math.radians(5.0)


class RecordedSource:
    """The scene of a recording.

    Args:
        path: as for `agent.recordings.load.read_recording`.
        options: how it is taken.

    Attributes:
        recording, segments: the recording, and the objects found in it.
        other_arm: see `SceneSource`.
        called: name of an object -> the noun that the user gave it.
        objects: in the order of their numbers.
        referents: the same, as an instruction can refer to them.
        pictures: where a picture is written that a question needs; `None` for the temporary folder.

    Raises:
        BadInput: for a recording that cannot be read, or without a table or objects.
        NotBuildable: if the arm can grasp none of its objects.
        UsageError: for a noun of an object that does not exist.
    """

    catalogue = False
    pictures: OwnFolder | None = None

    def __init__(self, path: Path, options: RecordedOptions = RecordedOptions()) -> None:
        self.recording = read_recording(path, options.reading)
        self.segments = perceive(self.recording)
        if not self.segments.objects:
            raise BadInput("; ".join((f"{str(path)!r} shows a table and no object on it", *self.segments.notes)))
        self.called = options.nouns
        self.other_arm = self.recording.other_arm
        self.objects = recorded_objects(self.segments, options)
        self.referents = [
            SceneObject(each.display_name, attributes_at(each.attributes, each.world_from_object))
            for each in self.objects
        ]
        if all(each.trouble for each in self.objects):
            those = f"the arm can take none of the {len(self.objects)} objects in {str(path)!r}"
            raise NotBuildable("; ".join((those, *self._left_out(), *self.segments.notes)))

    def _left_out(self) -> list[str]:
        """Say why the arm cannot grasp some objects, a phrase for each reason."""
        names: dict[str, list[str]] = {}
        for each in self.objects:
            if each.trouble:
                names.setdefault(each.trouble, []).append(each.name)
        return [f"{trouble}: {', '.join(those)}" for trouble, those in names.items()]

    @property
    def hint(self) -> str:
        """See `SceneSource`."""
        hints = self._left_out()
        unnamed = next((each.name for each in self.objects if each.model.category == UNKNOWN), None)
        if unnamed is not None:
            hints.append(how_to_name(self.segments.objects, unnamed, self._numbered(), self.pictures))
        return "; ".join(hints)

    def call(self, table: TableScene, nouns: Mapping[str, str]) -> None:
        """See `SceneSource`."""
        told = taken_nouns(self.segments.objects, self.called)
        self.called = {
            **self.called,
            **{
                found.name: nouns[each.name]
                for found, each in zip(self.segments.objects, self.objects, strict=True) if each.name in nouns
            },
        }  # fmt: skip
        before = self.objects
        self.objects = tuple(called(each, nouns[each.name]) if each.name in nouns else each for each in before)
        self.referents = [
            replace(referent, name=each.display_name)
            for referent, each in zip(self.referents, self.objects, strict=True)
        ]
        gone = set(told) - set(taken_nouns(self.segments.objects, self.called))
        table.notes = tuple(note for note in table.notes if note not in gone)
        table.call(
            {
                each.name: (now.name, now.display_name, now.model.category)
                for each, now in zip(before, self.objects, strict=True) if each.name in nouns
            }
        )  # fmt: skip

    def _check_nouns(self, goal: Interpretation, nouns: Sequence[str], chosen: Sequence[int]) -> None:
        """Ask which objects are meant if other ones would be, were an object what it may be by its picture.

        Raises:
            NotBuildable: with the question.
        """

        def changes(index: int, noun: str) -> bool:
            there = list(self.referents)
            there[index] = replace(there[index], name=called(self.objects[index], noun).display_name)
            return goal.among(there).goal != goal.goal

        if unsure := doubts(self.segments.objects, self.called, nouns, chosen, changes):
            how = how_to_name((), next(iter(unsure)), self._numbered(), self.pictures)
            raise NotBuildable("; ".join(("which objects are meant is not certain", *unsure.values(), how)))

    def _numbered(self) -> np.ndarray:
        return labelled_picture(self.recording, self.segments)

    def open(self, goal: Interpretation, seed: int) -> RecordedScene:
        """See `SceneSource`; from the seed follows the sensor's noise in later looks."""
        selection = goal.selection
        nouns = () if selection is None else selection.nouns
        self._check_nouns(goal, nouns, () if selection is None else selection.indices)
        telling = bool(nouns)
        if goal.goal.plain_spec is None:
            return RecordedScene(self, self.objects, len(self.objects), seed, telling)
        assert selection is not None
        asked = [self.objects[index] for index in selection.indices]
        if refused := [self.objects[i] for i in _named(goal) if self.objects[i].trouble]:
            those = "; ".join(f"{each.name} cannot take part: {each.trouble}" for each in refused)
            raise NotBuildable(f"the instruction names objects that the arm cannot take: {those}")
        selected = [each for each in asked if not each.trouble]
        try:
            check_count([each.name for each in selected], len(self.objects), goal.spec)
        except SceneError as error:
            raise SceneError("; ".join((str(error), *self._left_out()))) from error
        scene = RecordedScene(
            self, [*selected, *(each for each in self.objects if each not in selected)], len(selected), seed, telling
        )
        scene.missing = {each.name: each.trouble for each in asked if each.trouble}
        self._without_fallen(scene, goal, {self.objects[i].name for i in _named(goal)})
        return scene

    def _without_fallen(self, scene: RecordedScene, goal: Interpretation, required: set[str]) -> None:
        """Leave out the participants that fell off the table while the twin came to rest, as phantoms at its edge do.

        Raises:
            NotBuildable: if the instruction names one of them.
            SceneError: if too few are left.
        """
        taking = scene.names[: scene.count]
        if not (fell := [name for name in taking if name in scene.fallen]):
            return
        if named := [name for name in fell if name in required]:
            raise NotBuildable(f"the instruction names objects whose bodies {_FELL}: {', '.join(named)}")
        kept = [name for name in taking if name not in fell]
        check_count(kept, len(self.objects), goal.spec)
        scene.missing = {**scene.missing, **dict.fromkeys(fell, f"its body {_FELL}")}
        scene.involve(kept)

    def set_out(self, seed: int) -> RecordedScene:
        """See `SceneSource`."""
        ordered = sorted(self.objects, key=lambda each: bool(each.trouble))
        return RecordedScene(self, ordered, sum(not each.trouble for each in self.objects), seed)

    def saved(self, table: TableScene, folder: Path) -> list[PlacedObject]:
        """Return the scene as `SceneSource.saved` does; the bodies are written to a folder of meshes beside the scene
        file.
        """
        import trimesh  # takes long to import, and only saving needs it

        meshes = folder / _MESHES
        meshes.mkdir(parents=True, exist_ok=True)
        pose_of = table.poses()
        standing = []
        for each in self.objects:
            surface = trimesh.Trimesh(each.model.mesh_vertices, each.model.mesh_faces, process=False)
            mesh = surface.export(file_type="ply")
            assert isinstance(mesh, bytes)
            # Its content is in its name: another scene in the same folder keeps its own "object 1".
            stem = re.sub(r"[^a-z0-9]+", "-", each.name.lower())
            file = meshes / f"{stem}-{hashlib.sha256(mesh).hexdigest()[:8]}.ply"
            file.write_bytes(mesh)
            color = "#" + "".join(f"{round(255 * share):02x}" for share in each.model.color)
            placed = PlacedObject(
                str(file), name=each.name, noun=each.model.category, color=color,
                **placement_of(each.model, pose_of[each.name]),
            )  # fmt: skip
            standing.append(StandingObject(placed, each.name, each.model, pose_of[each.name], file.resolve()))
        return saved_objects(standing, [pose_of[each.name] for each in standing], folder)


class RecordedScene(TableScene):
    """The twin of a recorded scene, before the arm has moved anything.

    Args:
        source: the recording with the objects found in it.
        ordered: its objects, participants first.
        count: how many take part.
        seed: the sensor's noise in later looks, and which points are kept of large clouds, follow from it.
        telling: whether it is noted which nouns come from the picture.
    """

    def __init__(
        self, source: RecordedSource, ordered: Sequence[RecordedObject], count: int, seed: int, telling: bool = True
    ) -> None:
        segments, frame = source.segments, source.recording.frame
        thinning, noise = drawing_and_noise(seed)
        height, width = frame.points.shape[:2] if frame.organised else (480, 640)
        focal = None if frame.intrinsics is None else float(frame.intrinsics[1, 1])
        super().__init__(
            [each.model for each in ordered],
            np.array([each.world_from_object for each in ordered]),
            count,
            noise,
            Workcell(
                segments.table,
                segments.surface,
                camera_at(segments.world_from_camera, width, height, focal),
                source.recording.arm,
                segments.world_from_base,
            ),
            names=[each.name for each in ordered],
            display_names=[each.display_name for each in ordered],
            attributes=[each.attributes for each in ordered],
        )
        self.out_of_reach = {each.name: each.trouble for each in ordered if each.trouble}
        left_out = [f"{name} is left where it is: {trouble}" for name, trouble in self.out_of_reach.items()]
        self.bodies = "the twin's bodies"
        self.labelled = labelled_picture(source.recording, segments)
        self._picture = frame.color if frame.organised else None
        self._intrinsics = frame.intrinsics
        self._world_from_camera = segments.world_from_camera
        called = {found.name: each.name for found, each in zip(segments.objects, source.objects, strict=True)}
        hidden = {called[one.name]: called[one.rests_on] for one in segments.objects if not one.support_seen}
        self.supposed = frozenset(hidden)
        seeming = (f"{name} seems to stand on {on}: the camera does not see its support" for name, on in hidden.items())
        found = (*source.recording.notes, *segments.notes, *seeming)
        self.confidences = {
            each.name: round(each.confidence, 2)
            for each in segments.objects
            if each.confidence is not None and each.name not in source.called
        }
        taken = taken_nouns(segments.objects, source.called) if telling else []
        self.notes = (*taken, *found, *left_out, *self.notes, *self._come_to_rest())
        self._unsteady = frozenset(self.names[index] for index in self.world.held)
        self.remember({each.name: _thinned(each.cloud, thinning) for each in ordered})

    def _come_to_rest(self) -> list[str]:
        """Let the bodies settle; return a note for each that would leave its observed place, and is held there.

        The objects themselves stand: where a body does not, what was not seen of it, or of what carries it, was
        completed badly. A body beyond the table's edge is none that stands there, and falls.
        """
        notes: list[str] = []
        while True:
            self.world.settle(_SETTLE_SECONDS)
            moved = [i for i, now in enumerate(self.world.poses()) if i not in self.world.held and self._left(i, now)]
            if not moved:
                return notes
            for index, pose in enumerate(self.world_from_initial):
                if self._over_table(index):
                    self.world.set_pose(index, pose)
            for index in moved:
                self.world.hold(index)
                notes.append(
                    f"{self.names[index]} is held where it was seen until the arm takes it, because its body would not "
                    "stay there: the hidden sides of it, or of what it stands on, may be wrong"
                )

    def _left(self, index: int, now: np.ndarray) -> bool:
        """Return whether an object over the table is no longer at its observed place."""
        before = self.world_from_initial[index]
        gone = float(np.linalg.norm(now[:3, 3] - before[:3, 3])) > _STAYS or tilt_between(now, before) > _TILTED
        return gone and self._over_table(index)

    def _over_table(self, index: int) -> bool:
        return self.world.ground.overhang(self.world_from_initial[index][None, :2, 3]) <= 0.0

    def put_back(self, poses: Mapping[str, np.ndarray]) -> tuple[str, ...]:
        """See `TableScene.put_back`; what was held where it was seen is held there again."""
        moved = super().put_back(poses)
        for index, name in enumerate(self.names):
            if name in self._unsteady:
                self.world.free(self.world.bodies[index])
                if np.abs(poses[name] - self.world_from_initial[index]).max() <= _STAYS:
                    self.world.hold(index)
        return moved

    def _rename(self, names: Mapping[str, str]) -> None:
        super()._rename(names)
        self._unsteady, self.supposed = renamed((self._unsteady, self.supposed), names)

    def look(self) -> Scene:
        """Observe the table; as long as nothing has moved, return the recorded observation."""
        scene = super().look()
        if self._picture is None or not self.untouched:
            return scene
        return replace(
            scene,
            color=self._picture,
            intrinsics=self._intrinsics,
            world_from_camera=self._world_from_camera,
        )


def _thinned(cloud: ObjectCloud, rng: np.random.Generator) -> ObjectCloud:
    """Keep at most as many points as the models take."""
    if len(cloud.points) <= SURFACE_POINTS:
        return cloud
    kept = np.sort(rng.choice(len(cloud.points), SURFACE_POINTS, replace=False))
    return replace(cloud, points=cloud.points[kept], colors=None if cloud.colors is None else cloud.colors[kept])


def _named(goal: Interpretation) -> tuple[int, ...]:
    """Return the objects that an instruction names one by one, so that none of them can be left out."""
    found = goal.selection
    return found.indices if found is not None and found.singly else ()
