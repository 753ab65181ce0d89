"""Measure how close bodies completed from partial views come to the true ones: `structagent evaluate completion`.

All methods of completion get the same simulated views. For each object, the completed surface and volume are compared
with the true ones. For each scene, the completed bodies are moved as its reference arrangement moves the true ones,
which do not collide there; and pairs of objects are placed side by side at distances at which the true ones just touch,
or just do not. Two bodies collide if they penetrate each other by more than the 2 mm of the evaluation protocol.
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

from agent.evaluation.report import (
    command_line,
    interval,
    left_out_note,
    percent,
    print_footer,
    print_table,
    rate_of,
    report_by_structure,
    report_frame,
)
from agent.evaluation.rows import LOST, Row, collect, lost_scene_row
from grounding.spec import FIRST_SHAPES, SHAPES
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

_SURFACE = 4096  # points on each compared surface
_VOLUME = 4000  # points in the box around both bodies
_PAIRS = 8  # per scene
_NEXT_TO = 0.010  # m: the largest penetration or clearance of the true bodies of a pair
_FAR = 0.5  # m


def measure_completion(objects: str, count: int, seed: int, workers: int) -> Row:
    """Measure every method of completion on the same views, over `count` scenes of each structure; JSON-ready.

    Args:
        objects: as for `load_objects`.
        count: scenes per structure.
        seed: of scenes, sensor noise and placements.
        workers: processes.
    """
    drawn = draw_evaluation_scenes(load_objects(objects), count, seed=seed, workers=workers)
    scenes, lost = collect("scenes drawn", drawn, count * len(FIRST_SHAPES))
    compared = in_parallel(partial(_compare_methods, METHODS), tuple, (), scenes, workers)
    rows, lost_later = collect("scenes completed", compared, len(scenes))
    nouns = sorted({thing["noun"] for row in rows for thing in row["objects"]})
    frame = report_frame(command_line("completion", objects=objects, scenes=count, seed=seed), len(rows), seed)
    return report_by_structure(frame, rows, _rates) | {
        "nouns": {noun: _mean_errors(rows, partial(_is_a, noun)) for noun in nouns},
        LOST: [lost_scene_row(seed, one) for one in lost + lost_later],
    }


def print_completion(report: dict[str, Any], results: TextIO) -> None:
    """Print the tables: the methods over all scenes, then per structure and per noun."""
    every = report["aggregate"]["all"]
    shares = [cell for name in ("arrangements free", "pairs free", "collisions found") for cell in (name, "95 %")]
    table = [["method", "Chamfer, mm", "IoU", *shares, "seconds"]]
    for method, rates in every.items():
        cells = [method, f"{rates['chamfer']:.1f}", f"{rates['iou']:.2f}"]
        for key in ("free", "pairs_free", "pairs_colliding"):
            cells += [f"{rates[key]['count']}/{rates[key]['n']}", interval(rates[key])]
        table.append([*cells, f"{rates['seconds']:.2f}"])
    print_table(table, results)
    methods = list(every)
    table = [["arrangements free", "n", *methods]]
    for structure, rates in report["aggregate"].items():
        shares = [f"{percent(rates[method]['free']['rate'])} %" for method in methods]
        table.append([structure, str(rates[methods[0]]["free"]["n"]), *shares])
    print(file=results)
    print_table(table, results)
    table = [["Chamfer, mm / IoU", "n", *methods]]
    for noun, errors in report["nouns"].items():
        pairs = [f"{errors[method]['chamfer']:.1f} / {errors[method]['iou']:.2f}" for method in methods]
        table.append([noun, str(errors[methods[0]]["n"]), *pairs])
    print(file=results)
    print_table(table, results)
    print_footer(report, results, left_out_note(len(report[LOST])))


def _compare_methods(methods: Sequence[str], _: object, scene: EvaluationScene) -> Row:
    """Complete the objects of one scene with all methods; return its row."""
    drawn, observed = scene.drawn, scene.observed()
    models, initial = drawn.models[: drawn.count], drawn.world_from_initial[: drawn.count]
    reference = drawn.reference_goal_from_initial()
    rng = np.random.default_rng((scene.seed, SHAPES.index(scene.structure), scene.number, scene.draw, 3))
    with TabletopWorld(models, initial) as world:
        pairs = [_place_pair(world, initial, rng) for _ in range(_PAIRS)]
    truths = [_Truth(model, pose, rng) for model, pose in zip(models, initial, strict=True)]
    things: list[Row] = [{"name": model.name, "noun": model.category} for model in models]
    row: Row = {"structure": scene.structure, "number": scene.number, "seed": scene.seed, "objects": things}
    row["pairs"] = [{"objects": [i, j], "penetration": depth} for i, j, _, depth in pairs]
    for method in methods:
        bodies = []
        for cloud, truth, thing in zip(observed.objects, truths, things, strict=True):
            started = time.perf_counter()
            body, pose = body_of(cloud, observed.world_from_camera, method)
            seconds = time.perf_counter() - started
            chamfer, iou = truth.errors(body, pose, rng)
            thing[method] = {"chamfer": chamfer, "iou": iou, "seconds": seconds}
            bodies.append((body, pose))
        start = [pose for _, pose in bodies]
        with TabletopWorld([body for body, _ in bodies], start) as world:
            everything = itertools.combinations(range(drawn.count), 2)
            row[method] = max(_penetration(world, start, reference, i, j) for i, j in everything)
            for pair, (i, j, motions, _) in zip(row["pairs"], pairs, strict=True):
                pair[method] = _penetration(world, start, motions, i, j)
    return row


class _Truth:
    """The true body of an object at its observed pose: points on its surface, and its convex parts."""

    def __init__(self, model: ObjectModel, world_from_object: np.ndarray, rng: np.random.Generator) -> None:
        self.parts = tuple(transform_points(world_from_object, part) for part in model.hulls)
        if model.source == "procedural":  # its mesh also has the inner faces
            surface, _ = solids.sample_surface(model.hulls, _SURFACE, rng)
        else:
            mesh = trimesh.Trimesh(model.mesh_vertices, model.mesh_faces, process=False)
            surface, _ = meshes.sample_surface(mesh, _SURFACE, int(rng.integers(2**31)))
        self.surface = transform_points(world_from_object, surface.astype(np.float64))

    def errors(self, body: ObjectModel, pose: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
        """Return the symmetric Chamfer distance, millimetres, and the intersection over union of the volumes."""
        parts = tuple(transform_points(pose, part) for part in body.hulls)
        surface, _ = solids.sample_surface(parts, _SURFACE, rng)
        there, back = cKDTree(surface).query(self.surface)[0], cKDTree(self.surface).query(surface)[0]
        corners = np.concatenate((*parts, *self.parts))
        probes = rng.uniform(corners.min(axis=0), corners.max(axis=0), (_VOLUME, 3))
        guessed, true = signed_distance(probes, parts) <= 0, signed_distance(probes, self.parts) <= 0
        return 500 * float(there.mean() + back.mean()), float((guessed & true).sum() / max(1, (guessed | true).sum()))


def _penetration(world: TabletopWorld, start: Sequence[np.ndarray], motions: np.ndarray, i: int, j: int) -> float:
    """Return how deep, metres, two bodies penetrate each other after the motions (N, 4, 4) from their start poses."""
    for index in (i, j):
        world.set_pose(index, motions[index] @ start[index])
    return max(0.0, -world.clearances(i, among=[j]).get(j, 0.0))


def _place_pair(
    world: TabletopWorld, initial: np.ndarray, rng: np.random.Generator
) -> tuple[int, int, np.ndarray, float]:
    """Place two of the true objects side by side; return which, the motions (N, 4, 4), and the penetration, metres."""
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


def _is_a(noun: str, thing: Row) -> bool:
    return bool(thing["noun"] == noun)


def _mean_errors(rows: Sequence[Row], chosen: Callable[[Row], bool]) -> dict[str, dict[str, float]]:
    """Return the mean errors of each method over the chosen objects."""
    things = [thing for row in rows for thing in row["objects"] if chosen(thing)]
    keys = ("chamfer", "iou", "seconds")
    return {
        method: {"n": len(things), **{key: float(np.mean([thing[method][key] for thing in things])) for key in keys}}
        for method in METHODS
    }


def _rates(rows: Sequence[Row]) -> dict[str, Row]:
    """Return the errors and the collision rates of each method over some scenes."""
    pairs = [pair for row in rows for pair in row["pairs"]]
    free = [pair for pair in pairs if pair["penetration"] <= MAX_PENETRATION]
    colliding = [pair for pair in pairs if pair["penetration"] > MAX_PENETRATION]
    return {
        method: {
            **errors,
            "free": rate_of([row[method] <= MAX_PENETRATION for row in rows]),
            "pairs_free": rate_of([pair[method] <= MAX_PENETRATION for pair in free]),
            "pairs_colliding": rate_of([pair[method] > MAX_PENETRATION for pair in colliding]),
        }
        for method, errors in _mean_errors(rows, lambda _: True).items()
    }
