"""Make examples for the network that merges pieces: pairs of pieces of which the truth is known.

Recordings are those of synthetic tables with and without prints, and of simulated hard scenes; three of ten have no
colours. Pairs are described as they are found, and again while pieces of the same object are merged in a random order.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from agent.errors import BadInput
from agent.evaluation.hard_scenes import condition_of, hard_scene
from agent.evaluation.recorded_masks import RecordingJob, record_job
from agent.evaluation.segmentation.synthetic_tables import synthetic_table
from agent.perception.object_clusters import evidence_of
from agent.perception.piece_merging import PieceGraph
from agent.perception.pieces import Piece, Pieces, Proposals, Surface
from agent.perception.segmentation import measurement
from agent.recordings.load import read_recording
from agent.recordings.recording import DepthFrame, Recording
from agent.scenes.files import SceneFileError
from agent.synthetic_tables.arrangements import ARRANGEMENTS
from grounding.spec import FIRST_SHAPES, SHAPES
from structdiffusion.data.scene_sampling import SceneError, draw_scene, full_spec
from structdiffusion.objects.model import ObjectModel

OBJECTS = "training"
KINDS = (*ARRANGEMENTS, *FIRST_SHAPES)  # of tables, and of structures whose scenes are made hard
_WITHOUT_COLOR = 0.3  # share of recordings
_PURE = 0.75  # of a piece's voxels, without those of nothing, belong to the object that it is counted for
_EDGE = 0.3  # of a piece's voxels: with fewer of any object it is none; at the edges of objects there is no truth
_USUAL = 150  # voxels of a piece that counts in full
_LEAST_WEIGHT = 0.1


@dataclass(frozen=True)
class Example:
    """A pair of pieces.

    Attributes:
        features: of `Pieces.features`.
        one: whether they are of one object.
        weight: less for small pieces.
    """

    features: dict[str, float]
    one: bool
    weight: float


@dataclass(frozen=True)
class Place:
    """What to draw: a table of a class of `ARRANGEMENTS`, or a hard scene of a structure, and its number."""

    kind: str
    number: int
    seed: int


def places(tables: int, recordings: int, seed: int) -> list[Place]:
    """Return so many tables of every class, and hard recordings of every structure."""
    drawn = [Place(kind, number, seed) for number in range(tables) for kind in ARRANGEMENTS]
    return drawn + [Place(structure, number, seed) for number in range(recordings) for structure in FIRST_SHAPES]


def examples_at(library: Sequence[ObjectModel], place: Place) -> list[Example]:
    """Draw a table or a scene, and return its examples; none where it cannot be drawn.

    Args:
        library: the objects of scenes, those named `OBJECTS`.
        place: which to draw.
    """
    rng = np.random.default_rng((place.seed, KINDS.index(place.kind), place.number))
    if place.kind in ARRANGEMENTS:
        # With and without prints in turn.
        cloud = synthetic_table(place.kind, "development", place.seed, place.number, place.number % 2 == 0)
        recording, labels = Recording(Path(cloud.name), DepthFrame(cloud.points, cloud.color)), cloud.labels
    else:
        try:
            recording, labels = _recorded(library, place, rng)
        except (SceneError, SceneFileError):
            return []  # no such scene of these objects
    if rng.random() < _WITHOUT_COLOR:
        recording = replace(recording, frame=replace(recording.frame, color=None))
    try:
        seen = measurement(recording)
    except BadInput:
        return []  # no table is found
    evidence = evidence_of(seen.points)
    if evidence is None:
        return []
    of_point = labels.ravel()[seen.pixels][evidence.solid]
    votes = np.zeros((len(evidence.voxels.count), int(labels.max()) + 1), dtype=np.int64)
    np.add.at(votes, (evidence.voxels.of_point, of_point), 1)
    return pair_examples(evidence.surface, evidence.proposals, votes.argmax(axis=1), rng)


def _recorded(library: Sequence[ObjectModel], place: Place, rng: np.random.Generator) -> tuple[Recording, np.ndarray]:
    """Record a hard scene; return its true labels (H, W) too.

    Raises:
        SceneError, SceneFileError: if there is no such scene of these objects.
    """
    condition = condition_of(SHAPES.index(place.kind), place.number)
    drawn = draw_scene(library, full_spec(place.kind, rng), rng, distractors=0)
    job = RecordingJob(place.kind, place.number, place.seed, drawn, hard_scene(drawn, condition, rng))
    with TemporaryDirectory() as folder:
        recorded = record_job(job, OBJECTS, place.seed, Path(folder))
        recording = read_recording(recorded.bag)
    labels = np.zeros(recording.frame.points.shape[:2], dtype=np.int64)
    for index, mask in enumerate(recorded.masks.values()):
        labels[mask] = index + 1
    return recording, labels


def pair_examples(surface: Surface, proposals: Proposals, truth: np.ndarray, rng: np.random.Generator) -> list[Example]:
    """Return examples of pairs.

    Args:
        surface, proposals: as `Pieces` takes them.
        truth: (V,) the true object of each voxel, from 1 on; 0 for none.
        rng: for the order in which pieces are merged.
    """
    graph = PieceGraph(Pieces(surface, proposals))
    examples = list[Example]()

    def describe(pairs: Iterable[tuple[int, int]]) -> None:
        for pair in pairs:
            both = [graph.pieces[number] for number in pair]
            (one, pure), (other, its_pure) = (_true_object(piece, truth) for piece in both)
            if max(one, other) > 0 and min(pure, its_pure) >= _PURE:
                size = min(len(piece.own) for piece in both)
                examples.append(Example(graph.features(pair), one == other, min(1.0, _LEAST_WEIGHT + size / _USUAL)))

    describe(graph.pairs)
    while True:
        objects = {number: _true_object(piece, truth)[0] for number, piece in graph.pieces.items()}
        alike = [pair for pair in graph.pairs if objects[pair[0]] == objects[pair[1]] > 0]
        if not alike:
            return examples
        graph.merge(*alike[int(rng.integers(len(alike)))])
        describe(graph.refresh())


def _true_object(piece: Piece, truth: np.ndarray) -> tuple[int, float]:
    """Return the object that most of a piece belongs to, 0 for none, and how much of the piece's objects it is."""
    count = np.bincount(truth[piece.own], minlength=2)
    if count[1:].max() <= _EDGE * len(piece.own):
        return 0, count[0] / len(piece.own)
    best = int(count[1:].argmax()) + 1
    return best, count[best] / count[1:].sum()
