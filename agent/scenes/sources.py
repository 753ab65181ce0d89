"""Provide tables for the pipeline: drawn for the instruction, placed by a file, or recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from agent.arm.arm_file import load_arm
from agent.arm.arm_model import ArmModel
from agent.errors import UsageError
from agent.recordings.recording import RecordedOptions
from agent.runtime.progress import report_when_slow
from agent.scenes.files import SUFFIXES, PlacedObject
from agent.scenes.limits import check_count
from agent.scenes.object_attributes import attributes_at, attributes_of
from agent.scenes.object_placement import drawn_objects, load_scene, saved_objects
from agent.scenes.random_scenes import assortment
from agent.scenes.several_parts import several_parts_scene
from agent.scenes.simulated import SimulatedScene
from agent.scenes.table_scene import TableScene, drawing_and_noise
from agent.scenes.validation import StandingObject
from agent.scenes.workcell import Workcell
from grounding.figures.names import is_figure
from grounding.parse_result import shortened
from grounding.resolve.attributes import SceneObject
from structdiffusion.limits import FOLDER_FILES, SLOW_BYTES
from structdiffusion.objects.libraries import load_objects

if TYPE_CHECKING:
    from grounding.interpretation import Interpretation

SIMULATED, EXAMPLE = "simulated", "example"
_NAMED = "only the objects of a recording can be given nouns; these have theirs from their library or scene file"
RECORDINGS = (".bag", ".db3", ".mcap", ".ply", ".pcd")


class SceneSource(Protocol):
    """A source of tables for instructions.

    Attributes:
        referents: the objects that an instruction can refer to: the present ones, or those that can be drawn.
        catalogue: whether they are objects that can be drawn.
        hint: advice for an instruction that uses other names; empty if there is none.
        other_arm: why a trajectory for the arm of the scene cannot be exported; empty if it can.
    """

    @property
    def referents(self) -> Sequence[SceneObject]: ...

    @property
    def catalogue(self) -> bool: ...

    @property
    def hint(self) -> str: ...

    @property
    def other_arm(self) -> str: ...

    def open(self, goal: Interpretation, seed: int) -> TableScene:
        """Open the table, on which the objects that the goal selected among the referents take part; close it.

        For a goal of several parts everything on the table takes part, in the order of the referents, or for a
        catalogue in the order in which it was drawn.

        Raises:
            SceneError: if these objects cannot make such a structure.
        """

    def set_out(self, seed: int) -> TableScene:
        """Return a table to talk about, on which everything takes part until the user says otherwise; close it."""

    def saved(self, table: TableScene, folder: Path) -> list[PlacedObject]:
        """Return the table as it stands now, as the lines of a scene file in `folder`."""

    def call(self, table: TableScene, nouns: Mapping[str, str]) -> None:
        """Give objects of a recording nouns, from now on: name -> noun.

        Raises:
            UsageError: if the scene is no recording.
        """


def scene_source(
    scene: str, objects: str, recorded: RecordedOptions = RecordedOptions(), arm: Path | None = None
) -> SceneSource:
    """Return the source that a run asks for.

    Args:
        scene: "simulated", "example", or the path of a scene file or a recording.
        objects: the library of a simulated scene, as for `load_objects`.
        recorded: how a recording is taken.
        arm: the file of another arm than the Jaco.

    Raises:
        UsageError: for an unknown kind of scene, for options of recordings without a recording, and for another arm
            than that of a recording.
        BadInput: for a file or folder that is not there or cannot be used.
        ObjectError: for objects that are not there.
    """
    path = Path(scene)
    if scene == EXAMPLE or path.suffix.lower() in RECORDINGS or (scene and path.is_dir()):
        if arm is not None:
            raise UsageError(
                f"--arm cannot be {shortened(str(arm))!r} with the recording {shortened(scene)!r}, on which a Jaco is "
                "planned for; leave out one of them"
            )
        from agent.recordings import example_path
        from agent.scenes.digital_twin import RecordedSource

        return RecordedSource(example_path() if scene == EXAMPLE else path, recorded)
    if recorded.given:
        raise UsageError(
            "--at, --topic, --camera-pose, --depth-unit and --call are for recordings, and --scene is "
            f"{shortened(scene)!r}"
        )
    if scene == SIMULATED:
        with report_when_slow(f"reading the meshes in {objects!r}", lambda: _has_much_to_read(Path(objects))):
            return DrawnSource(objects, arm)
    if path.suffix.lower() not in SUFFIXES and not path.is_file():
        files = ", ".join((*SUFFIXES, *RECORDINGS))
        raise UsageError(
            f"--scene cannot be {shortened(scene)!r}; legal: {SIMULATED}, {EXAMPLE}, a folder, or a file that ends in "
            f"one of {files}"
        )
    return FileSource(path, arm)


def _has_much_to_read(folder: Path) -> bool:
    files = islice(folder.rglob("*"), FOLDER_FILES)
    return folder.is_dir() and sum(file.stat().st_size for file in files if file.is_file()) > SLOW_BYTES


def _other(arm: Path | None) -> tuple[ArmModel | None, str]:
    """Return the arm of a file, and why no trajectory is exported for it."""
    if arm is None:
        return None, ""
    return load_arm(arm), f"the arm of {str(arm)!r} is no Jaco, and trajectories are written for a Jaco"


class DrawnSource:
    """Scenes drawn from a library so that the goal can be built."""

    catalogue = True
    hint = ""

    def __init__(self, objects: str, arm: Path | None = None) -> None:
        self._name = objects
        self._arm, self.other_arm = _other(arm)
        self._library = load_objects(objects)
        self.referents = [SceneObject(model.category, attributes_of(model)) for model in self._library]

    def open(self, goal: Interpretation, seed: int) -> TableScene:
        """See `SceneSource`."""
        spec = goal.goal.plain_spec
        # A word may need many blocks of few models
        if spec is None or (spec.shape is not None and is_figure(spec.shape)):
            return several_parts_scene(self._library, goal, seed, self._arm)
        return SimulatedScene(self._library, goal, seed, self._arm)

    def set_out(self, seed: int) -> TableScene:
        """See `SceneSource`.

        Raises:
            SceneError: if the library has not enough objects.
        """
        drawing, noise = drawing_and_noise(seed)
        drawn = assortment(self._library, drawing, turn=seed)
        workcell = Workcell(drawn.table, model=self._arm)
        return TableScene(drawn.models, drawn.world_from_initial, len(drawn.models), noise, workcell)

    def saved(self, table: TableScene, folder: Path) -> list[PlacedObject]:
        """Return the table as it stands now, as the lines of a scene file in `folder`."""
        poses = table.world.poses()
        return saved_objects(drawn_objects(table.models, poses, self._name, table.names), poses, folder)

    def call(self, table: TableScene, nouns: Mapping[str, str]) -> None:
        """See `SceneSource`."""
        raise UsageError(_NAMED)


class FileSource:
    """The scene of a file."""

    catalogue = False
    hint = ""

    def __init__(self, path: Path, arm: Path | None = None) -> None:
        self.standing = load_scene(path)
        self._arm, self.other_arm = _other(arm)
        self.referents = [
            SceneObject(entry.display_name, attributes_at(attributes_of(entry.model), entry.world_from_object))
            for entry in self.standing
        ]

    def open(self, goal: Interpretation, seed: int) -> TableScene:
        """See `SceneSource`; from the seed follows the sensor's noise."""
        return self.set_out(seed) if goal.goal.plain_spec is None else FileScene(self.standing, goal, seed, self._arm)

    def set_out(self, seed: int) -> TableScene:
        """See `SceneSource`; from the seed follows the sensor's noise."""
        _, noise = drawing_and_noise(seed)
        poses = np.array([entry.world_from_object for entry in self.standing])
        models, names = [entry.model for entry in self.standing], [entry.name for entry in self.standing]
        cell, display_names = Workcell(model=self._arm), [each.name for each in self.referents]
        return TableScene(models, poses, len(models), noise, cell, names, display_names)

    def saved(self, table: TableScene, folder: Path) -> list[PlacedObject]:
        """Return the table as it stands now, as the lines of a scene file in `folder`."""
        pose_of = dict(zip(table.names, table.world.poses(), strict=True))
        return saved_objects(self.standing, [pose_of[entry.name] for entry in self.standing], folder)

    def call(self, table: TableScene, nouns: Mapping[str, str]) -> None:
        """See `SceneSource`."""
        raise UsageError(_NAMED)


class FileScene(TableScene):
    """A table with the objects of a scene file: those that the instruction means take part, the rest must stand.

    Args:
        standing: the objects, in the order of the file.
        goal: what will be asked for, with those of the objects that it selected.
        seed: the sensor's noise follows from it.
        arm: another arm than the Jaco.

    Raises:
        SceneError: if too few or too many take part.
    """

    def __init__(
        self, standing: Sequence[StandingObject], goal: Interpretation, seed: int, arm: ArmModel | None = None
    ) -> None:
        assert goal.selection is not None
        selected = sorted(goal.selection.indices)
        check_count([standing[index].name for index in selected], len(standing), goal.spec)
        ordered = [standing[index] for index in (*selected, *(k for k in range(len(standing)) if k not in selected))]
        _, noise = drawing_and_noise(seed)
        super().__init__(
            [entry.model for entry in ordered],
            np.array([entry.world_from_object for entry in ordered]),
            len(selected),
            noise,
            Workcell(model=arm),
            names=[entry.name for entry in ordered],
            display_names=[entry.display_name for entry in ordered],
        )
