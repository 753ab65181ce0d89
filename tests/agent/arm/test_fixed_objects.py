from dataclasses import replace

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model
from agent.arm.fixed_objects import describe_fixed, with_fixed
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.solids import assemble, box
from structdiffusion.simulation.world import TabletopWorld

JACO = arm_model(DEFAULT_MODEL).hand


@pytest.fixture(scope="module")
def scene():
    chest = assemble(
        "chest", "chest", [box(0.2, 0.2, 0.0, 0.1)], density=300.0, friction=0.5, color=(0.5, 0.5, 0.5),
        source="procedural", rng=np.random.default_rng(0),
    )  # fmt: skip
    models = [procedural_object("can", 0), chest, procedural_object("plate", 0)]
    with TabletopWorld(models, [pose_from_xyz_yaw(0.45, y, 0.0, 0.0) for y in (-0.25, 0.0, 0.28)]) as world:
        return world.observe(np.random.default_rng(0), names=["can", "chest", "plate"])


def test_what_no_grasp_fits_is_fixed(scene):
    assert with_fixed(scene, JACO, "friction").fixed == (1,)
    raised = replace(scene, objects=tuple(replace(cloud, bottom=0.1) for cloud in scene.objects))
    assert with_fixed(raised, JACO, "friction").fixed == ()
    assert (
        with_fixed(scene, JACO, "friction").select((2, 1)).fixed == (1,)
        and with_fixed(scene, JACO, "friction").select((0, 2)).fixed == ()
    )


def test_it_is_said(scene):
    assert describe_fixed(scene) == ""
    assert (
        describe_fixed(with_fixed(scene, JACO, "friction"))
        == "no grasp fits the chest, so the chest stays, and the rest is laid out around it"
    )
    two = replace(scene, fixed=(0, 1))
    assert describe_fixed(two).startswith("no grasp fits the can and the chest, so the can and the chest stay")
    assert describe_fixed(two, (0, 2)).startswith("no grasp fits the can, so the can stays")
