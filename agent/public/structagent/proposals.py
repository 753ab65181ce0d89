"""Propose ranked goal poses for the objects of a scene."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.errors import NOT_BUILDABLE
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.spec import StructureSpec
from structagent.arguments import MOST_SEED, checked_integer, shown, wrong_argument
from structagent.engine import computing
from structagent.errors import StructagentError, public_errors
from structagent.instructions import (
    PARSERS,
    SceneGoal,
    check_choice,
    checked_goal,
    checked_members,
    checked_spec,
    scene_goal_of_parts,
    scene_goal_of_text,
)
from structagent.scenes import Scene
from structdiffusion.observation import Arrangement, Table
from structdiffusion.planners.registry import PLANNERS, legal_instead_of, networks_of

if TYPE_CHECKING:
    import torch
    from numpy.typing import ArrayLike

    from agent.pipeline.resources import ResourceCache
    from structdiffusion.planners.factory import Planner
    from structdiffusion.planners.goal_planner import GoalPlanner

MOST_PROPOSALS = 1024
FEWEST_OBJECTS, MOST_OBJECTS = 2, 12  # what makes a structure, and what the shipped networks know
_STILL = 5e-5  # entries of a motion that differ by less are those of no motion


@dataclass(frozen=True, eq=False, repr=False)
class Proposal:
    """One arrangement: where every object of the scene goes.

    Attributes:
        goal_from_initial: (N, 4, 4) float64, read-only, world frame, metres: point p of cloud i goes to
            `goal_from_initial[i] @ p` (p homogeneous); the identity for an object that stays where it is.
        scores: what ranked it, each in [0, 1], larger is better; "total" decides.
        valid: whether it is good enough to be built.
        world_from_structure: (4, 4) the structure's own frame, or `None`.
    """

    goal_from_initial: np.ndarray
    scores: Mapping[str, float]
    valid: bool
    world_from_structure: np.ndarray | None = None

    @property
    def score(self) -> float:
        """Return the total score, in [0, 1]."""
        return self.scores["total"]

    def __repr__(self) -> str:
        moving = int((abs(self.goal_from_initial - np.eye(4)) > _STILL).any(axis=(1, 2)).sum())
        which = "valid" if self.valid else "not valid"
        return f"Proposal({moving} of {len(self.goal_from_initial)} objects move; score {self.score:.3f}, {which})"


@dataclass(frozen=True, eq=False, repr=False)
class Proposals(Sequence[Proposal]):
    """Proposals for a scene, the best first.

    Attributes:
        spec: the parsed slots of one structure, world frame.
        scene: the objects, in the order of every array about them.
        moved: indices of the objects that take part, ascending; the others are obstacles. With a goal of several parts
            these are the objects that a part places, and those that a proposal sets aside to make room.
        notes: remarks about the interpretation, a sentence each.
        status: "ok", or "no valid arrangement" if there are only invalid ones, kept by `keep_invalid`.
        proposed: how many arrangements were proposed, those left out as invalid included.
        model: the planner's name.
        items: the proposals.
        goal: all parts that were understood, world frame; objects are indices into the scene's.
    """

    spec: StructureSpec
    scene: Scene
    moved: tuple[int, ...]
    notes: tuple[str, ...]
    status: str
    proposed: int
    model: str
    items: tuple[Proposal, ...]
    goal: Goal

    def __len__(self) -> int:
        return len(self.items)

    def __getitem__(self, index: Any) -> Any:
        return self.items[index]

    def __iter__(self) -> Iterator[Proposal]:
        return iter(self.items)

    def __repr__(self) -> str:
        names = ", ".join(self.scene.names[index] for index in self.moved)
        asked = f"{self.spec}; {names}"
        if self.goal.plain_spec is None:
            asked = describe_parts(self.goal.parts, self.scene.names)
        return f"Proposals({len(self)} of {self.proposed} by {self.model!r}: {asked}; {self.status})"

    def _repr_html_(self) -> str:
        from structagent.notebooks import proposals_html

        goal = Arrangement(self.best.goal_from_initial[list(self.moved)])
        ranked = [(each.scores, each.valid) for each in self.items]
        return proposals_html(self.scene.observation(self.moved), goal, ranked, self.notes)

    @property
    def best(self) -> Proposal:
        """Return the first proposal."""
        return self.items[0]

    def clouds_after(self, index: int = 0) -> tuple[np.ndarray, ...]:
        """Return the clouds of the scene moved to their goals: (P, 3) float64 each, world frame, metres."""
        motions = self.items[index].goal_from_initial
        return tuple(
            cloud @ motion[:3, :3].T + motion[:3, 3] for cloud, motion in zip(self.scene.clouds, motions, strict=True)
        )


@public_errors()
def propose(
    clouds: Sequence[ArrayLike] | np.ndarray | Scene,
    instruction: str | StructureSpec | Goal | Mapping[str, Any],
    *,
    names: Sequence[str | None] | None = None,
    colors: Sequence[ArrayLike | None] | None = None,
    bottoms: Sequence[float] | None = None,
    table: Table | Sequence[float] | None = None,
    objects: Sequence[int | str] | None = None,
    viewpoint: str = "robot",
    parser: str = PARSERS[0],
    model: str = "diffusion",
    weights: str | os.PathLike[str] | None = None,
    allow_unverified: bool = False,
    count: int = 64,
    seed: int | None = None,
    generator: torch.Generator | np.random.Generator | None = None,
    keep_invalid: bool = False,
) -> Proposals:
    """Propose goal poses for objects that were seen as point clouds.

    Args:
        clouds: N arrays (P, 3), metres, world frame, or a `Scene`.
        instruction: a sentence in English, which also selects the objects; or slots, as a `StructureSpec` or a
            dict such as {"shape": "circle", "size": "small"}; or a goal of several parts, as a `Goal` or a dict with
            the key "parts", whose objects are indices or names.
        names, colors, bottoms, table: of the clouds, as for `Scene.from_clouds`; not with a `Scene`.
        objects: with slots, the indices or names of the objects that take part; by default all.
        viewpoint: with a sentence, whose left and right is meant: "robot", or "opposite" for a person across the table.
        parser: with a sentence, "embedding", or "llm" for the local language model.
        model: the planner's name; `structagent models list --all` names them all.
        weights: a folder of checkpoints; by default those shipped.
        allow_unverified: take checkpoints that are not what their cards say.
        count: how many arrangements are proposed, 1 to 1024.
        seed: everything drawn at random follows from it, in [0, 2**63); 0 by default.
        generator: instead of a seed, a generator of torch (on the CPU) or NumPy, from which a seed is drawn.
        keep_invalid: also return arrangements that are not good enough to be built, with `Proposal.valid` false.

    Returns:
        The proposals, best first, with the slots that were understood and remarks about them.

    Raises:
        StructagentError: for invalid input, for an instruction that is refused, needs a question or names missing
            objects, and if no arrangement is valid (exit code 4).
    """
    scene = _scene_of(clouds, names=names, colors=colors, bottoms=bottoms, table=table)
    given = _given_goal(instruction, objects, scene)
    check_model(model)
    if given is not None:
        check_choice("viewpoint", viewpoint, ("robot",))
    count, folder = checked_integer("count", count, 1, MOST_PROPOSALS), checked_weights(weights)
    number = _checked_seed(seed, generator)
    with computing() as cache:
        goal = given
        if goal is None:
            assert isinstance(instruction, str)  # else it was given
            goal = scene_goal_of_text(cache, instruction, scene, viewpoint, parser)
        from agent.pipeline.table_goal import planned_as_structure

        if not planned_as_structure(goal.goal.plain_spec):
            planner = cache.goal_planner(model, folder, allow_unverified)
            return _ranked(
                *_arranged_parts(planner, model, scene, goal, count, number), scene, goal, model, keep_invalid
            )
        _check_number(goal, scene, model, most_objects(model, folder))
        single = cache.planner(model, folder, allow_unverified)
        arrangements = _arranged(cache, single, model, scene, goal, count, number)
        return _ranked(arrangements, goal.members, scene, goal, model, keep_invalid)


def _given_goal(instruction: Any, objects: Any, scene: Scene) -> SceneGoal | None:
    """Return the goal that slots and objects, or parts, give; `None` for a sentence."""
    sentence = isinstance(instruction, str)
    parts = isinstance(instruction, Goal) or (isinstance(instruction, Mapping) and "parts" in instruction)
    if objects is not None and (sentence or parts):
        what = "a sentence" if sentence else "a goal"
        raise wrong_argument(f"objects= goes with slots only: {what} itself says which objects are meant")
    if sentence:
        return None
    if parts:
        return scene_goal_of_parts(checked_goal(instruction, scene.names), len(scene))
    spec, members = checked_spec(instruction), checked_members(objects, scene.names)
    return SceneGoal(spec, members, (), Goal((StructurePart.of(spec, members),)))


def _scene_of(clouds: Any, **given: Any) -> Scene:
    if not isinstance(clouds, Scene):
        return Scene.from_clouds(clouds, **given)
    for argument, value in given.items():
        if value is not None:
            raise wrong_argument(f"{argument}= goes with arrays only: the Scene that was given has its own")
    return clouds


def check_model(model: Any) -> None:
    """Check the name of a planner.

    Raises:
        StructagentError: with names that are.
    """
    if not isinstance(model, str) or model not in PLANNERS:
        raise wrong_argument(f"model cannot be {shown(model)}; {legal_instead_of(str(model))}")


def checked_weights(weights: Any) -> Path | None:
    """Check and return the folder of checkpoints, absolute, or `None` for those shipped.

    Raises:
        StructagentError: for anything that is not a path.
    """
    if weights is not None and (not isinstance(weights, str | os.PathLike) or not os.fspath(weights)):
        raise wrong_argument(f"weights cannot be {shown(weights)}; legal: a folder of checkpoints, or None")
    return None if weights is None else Path(weights).absolute()


def _checked_seed(seed: Any, generator: Any) -> int:
    if generator is None:
        return checked_integer("seed", 0 if seed is None else seed, 0, MOST_SEED)
    if seed is not None:
        raise wrong_argument("seed and generator cannot be given together; legal: one of them")
    if isinstance(generator, np.random.Generator):
        return int(generator.integers(MOST_SEED))
    import torch

    if isinstance(generator, torch.Generator) and generator.device.type == "cpu":
        return int(torch.randint(MOST_SEED, (1,), generator=generator))
    raise wrong_argument(
        f"generator cannot be {shown(generator)}; legal: a torch.Generator on the CPU, or a numpy.random.Generator"
    )


def most_objects(model: str, weights: Path | None) -> int:
    """Return how many objects a planner's networks take at most."""
    if weights is None:
        return MOST_OBJECTS
    most = [MOST_OBJECTS]
    for network in networks_of(model):
        config = weights / network / "config.json"
        if config.is_file():  # what is missing or broken is named where it is loaded
            try:
                most.append(int(json.loads(config.read_text(encoding="utf-8"))["max_objects"]))
            except (ValueError, KeyError, TypeError):
                continue
    return min(most)


def _check_number(goal: SceneGoal, scene: Scene, model: str, most: int) -> None:
    """Refuse too few or too many objects."""
    from structdiffusion.structures import structure_named

    members = f"{len(goal.members)} of {len(scene)} objects ({', '.join(scene.names[index] for index in goal.members)})"
    shape = goal.spec.shape or "structure"
    fewest = FEWEST_OBJECTS if goal.spec.shape is None else structure_named(shape).least
    if len(goal.members) < fewest:
        raise StructagentError(
            f"the instruction means {members}, and a {shape} takes {fewest} to {most}", NOT_BUILDABLE
        )
    if len(goal.members) > most:
        raise StructagentError(
            f"the instruction means {members}, and the model {model!r} takes {most} at most", NOT_BUILDABLE
        )


def _arranged(
    cache: ResourceCache, planner: Planner, model: str, scene: Scene, goal: SceneGoal, count: int, seed: int
) -> Sequence[Arrangement]:
    """Return the arrangements as the pipeline ranks them, best first."""
    from agent.pipeline.proposing import make_goal, propose_arrangements

    observed, encoded = scene.observation(goal.members), make_goal(goal.spec, cache.encoder)
    return propose_arrangements(planner, model, observed, encoded, seed, count=count).arrangements


def _arranged_parts(
    planner: GoalPlanner, model: str, scene: Scene, goal: SceneGoal, count: int, seed: int
) -> tuple[Sequence[Arrangement], tuple[int, ...]]:
    """Return the arrangements for a goal of several parts, best first, and the objects that they are about."""
    from agent.pipeline.proposing import propose_goal
    from agent.pipeline.table_goal import TableGoal

    wanted = TableGoal(goal.goal, scene.names, np.tile(np.eye(4), (len(scene), 1, 1)))
    proposed = propose_goal(planner, model, scene.observation(range(len(scene))), wanted, seed, count)
    return proposed.arrangements, tuple(scene.names.index(cloud.name) for cloud in proposed.scene.objects)


def _ranked(
    arrangements: Sequence[Arrangement],
    moved: tuple[int, ...],
    scene: Scene,
    goal: SceneGoal,
    model: str,
    keep_invalid: bool,
) -> Proposals:
    from agent.pipeline.candidates import filter_viable, is_viable

    spec = goal.goal.plain_spec
    kept = arrangements if keep_invalid else filter_viable(arrangements, scene.observation(moved), spec)
    items = tuple(_proposal(each, moved, len(scene), is_viable(each)) for each in kept)
    status = "ok" if any(each.valid for each in items) else "no valid arrangement"
    notes = (*scene.notes, *goal.notes)
    return Proposals(goal.spec, scene, moved, notes, status, len(arrangements), model, items, goal.goal)


def _proposal(arrangement: Arrangement, members: Sequence[int], count: int, valid: bool) -> Proposal:
    motions = np.tile(np.eye(4), (count, 1, 1))
    motions[list(members)] = arrangement.goal_from_initial
    motions.flags.writeable = False
    return Proposal(motions, dict(arrangement.scores), valid, arrangement.world_from_structure)
