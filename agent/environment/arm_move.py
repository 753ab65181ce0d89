"""Let the arm pick one object and put it down at its goal, and say what came of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.arm.events import Placed, PlanFailed, Planned, SetAside
from agent.arm.executor import build_structure
from agent.arm.simulated_arm import SimulatedArm
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.simulation.world import TabletopWorld


@dataclass(frozen=True)
class ArmMove:
    """What became of a move by the arm.

    Attributes:
        refused: why the arm moved nothing; empty if it did.
        placed: whether it put the object down at its goal.
        set_aside: objects that it took out of the way.
    """

    refused: str
    placed: bool
    set_aside: tuple[int, ...]


def carry_out(
    world: TabletopWorld,
    arm: SimulatedArm,
    scene: Scene,
    index: int,
    goal_from_now: np.ndarray,
    rng: np.random.Generator,
) -> ArmMove:
    """Move one object of a scene by a motion (4, 4); all others stay, but for those that stand in the way.

    Args:
        world: the true objects.
        arm: the arm, in that world.
        scene: what was seen of it.
        index: of the object in the scene.
        goal_from_now: (4, 4) its motion, world frame.
        rng: of the arm's planning.
    """
    motions = np.tile(np.eye(4), (len(scene.objects), 1, 1))
    motions[index] = goal_from_now
    planned, reason, placed, aside = False, "the arm finds no plan", False, []
    for event in build_structure(world, arm, scene, [Arrangement(motions)], rng=rng):
        match event:
            case Planned():
                planned = True
            case PlanFailed():
                reason = f"the arm finds no plan: {event.reason}"
            case Placed(object=moved, aside=False) if moved == index:
                placed = True
            case SetAside(object=int(other), trouble=""):
                aside.append(other)
    return ArmMove("" if planned else reason, placed, tuple(aside))
