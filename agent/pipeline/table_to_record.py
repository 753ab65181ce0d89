"""Set out simulated tables for recording as a run would, before any motion of the arm."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.jaco_hand import FINGER_OPEN, FINGERS
from agent.arm.state import ArmState
from agent.errors import NotBuildable
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.resources import ResourceCache
from agent.scenes.files import PlacedObject
from agent.scenes.sources import SIMULATED, SceneSource
from agent.scenes.table_scene import TableScene, drawing_and_noise
from agent.scenes.workcell import Workcell


@dataclass(frozen=True)
class TableToRecord:
    """The options of a scene that is to be recorded.

    Attributes:
        scene: "simulated", or the path of a scene file.
        objects: the library of a simulated scene, as for `load_objects`.
        instruction: a scene is drawn for it as for a run; `None` for a table to talk about.
        arm: the arm's model, one of `ARM_MODELS`.
        seed: of everything drawn at random.
    """

    scene: str = SIMULATED
    objects: str = "ycb"
    instruction: str | None = None
    arm: str = DEFAULT_MODEL
    seed: int = 0


@dataclass(frozen=True)
class RecordableTable:
    """A table that can be recorded.

    Attributes:
        table: as it stands.
        source: the source of the scene.
    """

    table: TableScene
    source: SceneSource

    def truth(self, folder: Path) -> list[PlacedObject]:
        """Return what really stands there, as the lines of a scene file in `folder`."""
        return self.source.saved(self.table, folder)


@contextmanager
def recordable_table(wanted: TableToRecord) -> Iterator[RecordableTable]:
    """Set out the scene on its table, whose physics ends with the `with` block.

    Raises:
        NotBuildable: for an instruction that is not understood, or that names a missing object.
        SceneError: if the goal cannot be made with these objects.
        UsageError, BadInput, ObjectError: for a scene, arm or objects that there are not.
    """
    model, cache = arm_model(wanted.arm), ResourceCache()
    if wanted.instruction is None:
        source = cache.source(wanted.scene, wanted.objects)
        drawn = source.set_out(wanted.seed)
    else:
        source = cache.source(wanted.scene, wanted.objects)
        there = None if source.catalogue else source.referents
        goal = cache.interpreter(ReadingOptions()).interpret(wanted.instruction, there)
        if source.catalogue:
            goal = goal.among(source.referents, True)  # says what is missing before anything is drawn
        if goal.status != "ok":
            raise NotBuildable(goal.message)
        drawn = source.open(goal, wanted.seed)
    with drawn:
        if wanted.arm == DEFAULT_MODEL:
            yield RecordableTable(drawn, source)
            return
        poses, (_, noise) = drawn.world.poses(), drawing_and_noise(wanted.seed)
        joints = dict(zip(model.joints, model.folded.tolist(), strict=True)) | dict.fromkeys(FINGERS, FINGER_OPEN)
        workcell = Workcell(drawn.world.table, arm=ArmState(model.name, joints))
        with TableScene(
            drawn.models, np.array(poses), drawn.count, noise, workcell, drawn.names, drawn.display_names
        ) as table:
            yield RecordableTable(table, source)
