"""Record a simulated scene into a bag, and compare the objects that are found in it with their true masks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.evaluation.hard_scenes import HardScene, View
from agent.evaluation.rows import Row
from agent.scenes.digital_twin import RecordedSource
from agent.scenes.files import write_scene
from agent.scenes.object_placement import drawn_objects, saved_objects
from agent.scenes.record_bag import CAMERA_RATE, record_session, write_session
from agent.scenes.sources import FileSource
from agent.scenes.table_scene import TableScene
from structdiffusion.data.scene_sampling import DrawnScene
from structdiffusion.simulation.visible_points import MIN_POINTS

MATCHED = 0.5  # intersection over union above which a found mask counts as that object's


@dataclass(frozen=True)
class RecordingJob:
    """A scene to measure; `hard` has other places for its objects than `drawn`, and the view to record."""

    structure: str
    number: int
    seed: int
    drawn: DrawnScene
    hard: HardScene | None = None

    @property
    def poses(self) -> list[np.ndarray]:
        """Return the pose (4, 4) of each object."""
        return list(self.drawn.world_from_initial if self.hard is None else self.hard.world_from_initial)


@dataclass(frozen=True)
class RecordedBag:
    """A recorded scene.

    Attributes:
        scene, bag: its files.
        masks: name of each visible object -> its true mask (H, W).
        nouns: name of each object -> its noun.
    """

    scene: Path
    bag: Path
    masks: dict[str, np.ndarray]
    nouns: dict[str, str]


def record_job(job: RecordingJob, objects: str, seed: int, folder: Path) -> RecordedBag:
    """Write the scene of a job as a scene file, and record it into a bag."""
    drawn, scene, bag = job.drawn, folder / "scene.yaml", folder / "recording.bag"
    poses = job.poses
    write_scene(saved_objects(drawn_objects(drawn.models, poses, objects), poses, folder), scene)
    with FileSource(scene).set_out(seed) as table:
        if job.hard is None:
            record_session(table, bag, np.random.default_rng(seed))
            truth = table.world.look().segmentation
            masks = {name: truth == body for name, body in zip(table.names, table.world.bodies, strict=True)}
        else:
            masks = dict(zip(table.names, _recorded_view(table, job.hard.view, bag), strict=True))
        nouns = dict(zip(table.names, (each.category for each in table.models), strict=True))
    return RecordedBag(scene, bag, {name: mask for name, mask in masks.items() if mask.sum() >= MIN_POINTS}, nouns)


def _recorded_view(table: TableScene, view: View, bag: Path) -> np.ndarray:
    """Record one measurement into a bag, not several to average over; return the masks (M, H, W) of the objects."""
    write_session(table, view.camera, view.color, lambda: view.depth, bag, seconds=1.0 / CAMERA_RATE)
    return view.masks


def compare_masks(recording: RecordedBag, source: RecordedSource) -> tuple[Row, dict[str, str]]:
    """Compare the found masks with the true ones; return the row's keys about them,
    and a noun for each found object.
    """
    overlaps = overlaps_of(recording.masks, source.segments.labels)
    best = overlaps.max(axis=1, initial=0.0)  # of each true object
    count = len(source.segments.objects)
    exact = count == len(recording.masks) and bool((best > MATCHED).all())
    row = {"found": count, "exact": exact, "iou": round(float(best.mean()), 4), "ious": best.round(3).tolist()}
    names = list(recording.masks)
    nouns = {
        each.name: recording.nouns[names[int(overlaps[:, k].argmax())]]
        for k, each in enumerate(source.segments.objects)
    }
    return row, nouns


def overlaps_of(masks: dict[str, np.ndarray], labels: np.ndarray) -> np.ndarray:
    """Return the intersection over union (true objects, found objects) of the masks."""
    found = [labels == k + 1 for k in range(max(0, int(labels.max())))]
    return np.array(
        [[(mask & other).sum() / max(1, (mask | other).sum()) for other in found] for mask in masks.values()]
    ).reshape(len(masks), len(found))
