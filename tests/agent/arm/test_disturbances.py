"""What disturbs a build, and when: parsing, the moment, and a build in which it happens."""

import numpy as np
import pytest

from agent.arm.build_listeners import BuildListeners
from agent.arm.disturbances import DISTURBANCES, Disturbance, Disturber
from agent.arm.events import Disturbed, Picked, Placed
from agent.arm.executor import build_structure
from agent.arm.interference import keep_away
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import UsageError
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.blocks import block_objects
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.world import TabletopWorld

BLOCKS = {model.name: model for model in block_objects()}
MODELS = [BLOCKS[name] for name in ("pillar_red", "post_blue", "cube_50_green")]
START = np.array([pose_from_xyz_yaw(0.35, y, 0.0, 0.0) for y in (-0.3, -0.1, 0.1)])
GOALS = np.array([pose_from_xyz_yaw(0.55, y, 0.0, 0.0) for y in (-0.1, 0.05, 0.2)])


def built(text, seed=0, count=3, until=()):
    """Build a line of `count` objects with a disturbance, or begin to, until an event of a kind in `until`; return the
    events, and the disturber.

    The hand holds by a weld, for which the engine takes a quarter of the iterations: what is done to the table is the
    same.
    """
    happened = []
    with TabletopWorld(MODELS[:count], list(START[:count])) as world:
        arm = SimulatedArm(world.client)
        arm.hold_by("weld")
        scene = world.observe(np.random.default_rng(0))
        spare = keep_away(world, BLOCKS["cube_35_yellow"])
        names = ["pillar", "post", "cube"][:count] + ["new block"]
        disturber = Disturber(
            Disturbance.parse(text), world, arm, names, GOALS[None, :count], np.random.default_rng(seed), spare
        )
        goal = Arrangement(GOALS[:count] @ np.linalg.inv(START[:count]))
        listeners = BuildListeners(disturber.on_step)
        for event in build_structure(world, arm, scene, [goal], rng=np.random.default_rng(0), listeners=listeners):
            happened += disturber.events(event)
            if any(isinstance(event, until) for event in happened):
                break
        happened += disturber.rest()
    return happened, disturber


def before(happened, kind):
    """How many events of a kind come before the disturbance, and after it."""
    (place,) = [k for k, event in enumerate(happened) if isinstance(event, Disturbed)]
    return tuple(sum(isinstance(event, kind) for event in some) for some in (happened[:place], happened[place:]))


def test_disturbances_are_read():
    assert Disturbance.parse("push") == Disturbance("push") and str(Disturbance("swap", 2)) == "swap@2"
    assert all(Disturbance.parse(f"{kind}@12") == Disturbance(kind, 12) for kind in DISTURBANCES)


@pytest.mark.parametrize("text", ["", "pull", "push@", "push@0", "push@-1", "push@1.5", "push@x", "PUSH", "push@2@3"])
def test_what_cannot_be_read_is_answered_with_the_legal_values(text):
    with pytest.raises(UsageError) as error:
        Disturbance.parse(text)
    said = str(error.value)
    assert repr(text) in said and all(kind in said for kind in DISTURBANCES) and "push@2" in said


@pytest.mark.parametrize("kind", DISTURBANCES)
def test_each_happens_between_the_first_pick_and_the_last_placement(kind):
    happened, disturber = built(kind, seed=4, until=Disturbed)
    (told,) = [event for event in happened if isinstance(event, Disturbed)]
    assert told.disturbance == kind and told.name and told.detail and disturber.why_not == ""
    assert before(happened, Picked)[0] >= 1 and before(happened, Placed)[0] < 3
    if kind == "drop":
        last = [event for event in happened[: happened.index(told)] if isinstance(event, Picked | Placed)][-1]
        assert isinstance(last, Picked) and last.object == told.object


def test_a_disturbance_after_a_placement():
    happened, _ = built("remove@2", until=Disturbed)
    assert before(happened, Placed)[0] == 2


def test_a_disturbance_after_the_last_placement():
    happened, disturber = built("push@2", count=2)
    (place,) = [k for k, event in enumerate(happened) if isinstance(event, Disturbed)]
    assert before(happened, Placed)[0] == 2 and disturber.why_not == ""
    (again,) = [event for event in happened[place:] if isinstance(event, Placed)]
    assert again.object == happened[place].object and again.again.startswith("stood ")


def test_what_does_not_happen_says_why():
    happened, disturber = built("push@9", count=2)
    assert not any(isinstance(event, Disturbed) for event in happened)
    assert disturber.why_not == "the disturbance push@9 did not happen: there were only 2 placements"
    assert built("swap", count=2)[1].why_not.endswith("there will be nothing to which it could be done")


def test_the_same_seed_disturbs_in_the_same_way():
    first, second = (built("push", seed=7, count=2, until=Disturbed)[0] for _ in range(2))
    told = [[event for event in some if isinstance(event, Disturbed)] for some in (first, second)]
    assert told[0] and told[0] == told[1]
