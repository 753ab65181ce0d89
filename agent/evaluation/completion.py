"""`structagent evaluate completion`: how near the bodies guessed from partial views come to the true ones.

Every method of completion gets the same simulated views. Of each object, the guessed surface and volume are compared
with the true ones. Of each scene, the guessed bodies are moved as its reference arrangement moves the true ones, which
stand there free of each other; and pairs of objects are put next to each other at distances where the true ones just
touch, or just do not. Two bodies collide where they penetrate each other by more than the 2 mm of the protocol.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TextIO

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from agent.evaluation.common import LOST, left_out_note, parted, rate_of, report_of, row_of_lost
from agent.rendering.text import aligned
from agent.runtime.progress import followed
from grounding.spec import SHAPES
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scenes
from structdiffusion.completion.bodies import body_of
from structdiffusion.completion.methods import METHODS
from structdiffusion.evaluation_protocol import MAX_PENETRATION
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects import meshes, solids
from structdiffusion.objects.decomposition import signed_distance
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import in_parallel
from structdiffusion.simulation.world import TabletopWorld

_SURFACE = 4096  # points on each surface that is compared
_VOLUME = 4000  # points in the box around both bodies
_PAIRS = 8  # placements next to each other, per scene
_NEXT_TO = 0.010  # m: the most that the true bodies of a pair penetrate each other, or keep clear
_FAR = 0.5  # m


def measure_completion(objects: str, count: int, seed: int, workers: int) -> dict[str, Any]:
    """Every method of completion on the same views, over `count` scenes of each of the four structures, JSON-ready.

    Args:
        objects: as `load_objects` takes it.
        count: scenes per structure.
        seed: of scenes, sensor noise and placements.
        workers: processes.
    """
    drawn = draw_evaluation_scenes(load_objects(objects), count, seed=seed, workers=workers)
    scenes, lost = parted(followed("scenes drawn", drawn, count * len(SHAPES)))
    compared = in_parallel(partial(_compared, METHODS), tuple, (), scenes, workers)
    rows, more = parted(followed("scenes completed", compared, len(scenes)))
    left_out = [row_of_lost(one.job, seed, one.reason) for one in lost]
    left_out += [row_of_lost((one.job.structure, one.job.number), seed, one.reason) for one in more]
    nouns = sorted({thing["noun"] for row in rows for thing in row["objects"]})
    command = f"structagent evaluate completion --objects {objects} --scenes {count} --seed {seed}"
    return report_of(command, rows, _rates) | {
        "nouns": {noun: _nearness(rows, lambda thing, noun=noun: thing["noun"] == noun) for noun in nouns},
        LOST: left_out,
    }


def tell_completion(report: dict[str, Any], results: TextIO) -> None:
    """The tables for people: methods side by side over all, then per structure and per noun."""
    every = report["aggregate"]["all"]
    shares = [cell for name in ("arrangements free", "pairs free", "collisions told") for cell in (name, "95 %")]
    table = [["method", "Chamfer, mm", "IoU", *shares, "seconds"]]
    for method, rates in every.items():
        cells = [method, f"{rates['chamfer']:.1f}", f"{rates['iou']:.2f}"]
        for key in ("free", "pairs_free", "pairs_colliding"):
            rate = rates[key]
            cells += [f"{rate['count']}/{rate['n']}", f"{100 * rate['low']:.0f} to {100 * rate['high']:.0f}"]
        table.append([*cells, f"{rates['seconds']:.2f}"])
    print(aligned(table, left=1), file=results)
    methods = list(every)
    table = [["arrangements free", "n", *methods]]
    for structure, rates in report["aggregate"].items():
        shares = [f"{100 * rates[method]['free']['rate']:.0f} %" for method in methods]
        table.append([structure, str(rates[methods[0]]["free"]["n"]), *shares])
    print(f"\n{aligned(table, left=1)}", file=results)
    table = [["Chamfer, mm / IoU", "n", *methods]]
    for noun, nearness in report["nouns"].items():
        pairs = [f"{nearness[method]['chamfer']:.1f} / {nearness[method]['iou']:.2f}" for method in methods]
        table.append([noun, str(nearness[methods[0]]["n"]), *pairs])
    print(f"\n{aligned(table, left=1)}", file=results)
    if report[LOST]:
        print(f"\n{left_out_note(len(report[LOST]))}", file=results)
    print(f"\n{report['command']}", file=results)


def _compared(methods: Sequence[str], _: object, scene: EvaluationScene) -> dict[str, Any]:
    """All methods on one scene; the row of the report."""
    drawn, observed = scene.drawn, scene.observed()
    models, initial = drawn.models[: drawn.count], drawn.world_from_initial[: drawn.count]
    reference = drawn.reference_goal_from_initial()
    rng = np.random.default_rng((scene.seed, SHAPES.index(scene.structure), scene.number, scene.draw, 3))
    with TabletopWorld(models, initial) as world:
        pairs = [_next_to_each_other(world, initial, rng) for _ in range(_PAIRS)]
    truths = [_Truth(model, pose, rng) for model, pose in zip(models, initial, strict=True)]
    things: list[dict[str, Any]] = [{"name": model.name, "noun": model.category} for model in models]
    row: dict[str, Any] = {"structure": scene.structure, "number": scene.number, "seed": scene.seed, "objects": things}
    row["pairs"] = [{"objects": [i, j], "penetration": depth} for i, j, _, depth in pairs]
    for method in methods:
        bodies = []
        for cloud, truth, thing in zip(observed.objects, truths, things, strict=True):
            started = time.perf_counter()
            body, pose = body_of(cloud, observed.world_from_camera, method)
            seconds = time.perf_counter() - started
            chamfer, iou = truth.nearness(body, pose, rng)
            thing[method] = {"chamfer": chamfer, "iou": iou, "seconds": seconds}
            bodies.append((body, pose))
        with TabletopWorld(*zip(*bodies, strict=True)) as world:
            start = [pose for _, pose in bodies]
            everything = itertools.combinations(range(drawn.count), 2)
            row[method] = max(_penetration(world, start, reference, i, j) for i, j in everything)
            for pair, (i, j, motions, _) in zip(row["pairs"], pairs, strict=True):
                pair[method] = _penetration(world, start, motions, i, j)
    return row


class _Truth:
    """The true body of an object where it was seen: points on its surface, and its convex parts."""

    def __init__(self, model: ObjectModel, world_from_object: np.ndarray, rng: np.random.Generator) -> None:
        self.parts = tuple(transform_points(world_from_object, part) for part in model.hulls)
        if model.source == "procedural":  # its mesh has the faces inside, too
            surface, _ = solids.sample_surface(model.hulls, _SURFACE, rng)
        else:
            mesh = trimesh.Trimesh(model.mesh_vertices, model.mesh_faces, process=False)
            surface, _ = meshes.sample_surface(mesh, _SURFACE, int(rng.integers(2**31)))
        self.surface = transform_points(world_from_object, surface.astype(np.float64))

    def nearness(self, body: ObjectModel, pose: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
        """The symmetric Chamfer distance, millimetres, and the volumes' intersection over union."""
        parts = tuple(transform_points(pose, part) for part in body.hulls)
        surface, _ = solids.sample_surface(parts, _SURFACE, rng)
        there, back = cKDTree(surface).query(self.surface)[0], cKDTree(self.surface).query(surface)[0]
        corners = np.concatenate((*parts, *self.parts))
        probes = rng.uniform(corners.min(axis=0), corners.max(axis=0), (_VOLUME, 3))
        guessed, true = signed_distance(probes, parts) <= 0, signed_distance(probes, self.parts) <= 0
        return 500 * float(there.mean() + back.mean()), float((guessed & true).sum() / max(1, (guessed | true).sum()))


def _penetration(world: TabletopWorld, start: Sequence[np.ndarray], motions: np.ndarray, i: int, j: int) -> float:
    """How deep, metres, two bodies penetrate each other after the motions (N, 4, 4) from where they stood first."""
    for index in (i, j):
        world.set_pose(index, motions[index] @ start[index])
    return max(0.0, -world.clearances(i, among=[j]).get(j, 0.0))


def _next_to_each_other(
    world: TabletopWorld, initial: np.ndarray, rng: np.random.Generator
) -> tuple[int, int, np.ndarray, float]:
    """Two of the true objects put next to each other: which, the motions (N, 4, 4), and their penetration, metres."""
    i, j = (int(index) for index in rng.choice(len(initial), 2, replace=False))
    turns, direction = rng.uniform(-math.pi, math.pi, 2), rng.uniform(-math.pi, math.pi)
    wanted = rng.uniform(-_NEXT_TO, _NEXT_TO)
    near, far = 0.0, _FAR
    world.set_pose(i, pose_from_xyz_yaw(0.0, 0.0, 0.0, turns[0]))
    for _ in range(12):
        middle = 0.5 * (near + far)
        pose = pose_from_xyz_yaw(middle * math.cos(direction), middle * math.sin(direction), 0.0, turns[1])
        world.set_pose(j, pose)
        if world.clearances(i, reach=_FAR, among=[j]).get(j, _FAR) < wanted:
            near = middle
        else:
            far = middle
    motions = np.tile(np.eye(4), (len(initial), 1, 1))
    motions[[i, j]] = np.array([world.pose(i), world.pose(j)]) @ np.linalg.inv(initial[[i, j]])
    return i, j, motions, _penetration(world, list(initial), motions, i, j)


def _nearness(rows: Sequence[dict[str, Any]], which: Callable[[dict[str, Any]], bool]) -> dict[str, dict[str, float]]:
    """The means of each method over some of the objects."""
    things = [thing for row in rows for thing in row["objects"] if which(thing)]
    keys = ("chamfer", "iou", "seconds")
    return {
        method: {"n": len(things), **{key: float(np.mean([thing[method][key] for thing in things])) for key in keys}}
        for method in METHODS
    }


def _rates(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """What each method reaches over some scenes."""

    pairs = [pair for row in rows for pair in row["pairs"]]
    free = [pair for pair in pairs if pair["penetration"] <= MAX_PENETRATION]
    colliding = [pair for pair in pairs if pair["penetration"] > MAX_PENETRATION]
    return {
        method: {
            **nearness,
            "free": rate_of([row[method] <= MAX_PENETRATION for row in rows]),
            "pairs_free": rate_of([pair[method] <= MAX_PENETRATION for pair in free]),
            "pairs_colliding": rate_of([pair[method] > MAX_PENETRATION for pair in colliding]),
        }
        for method, nearness in _nearness(rows, lambda _: True).items()
    }
