"""Segment a depth measurement into a table and the objects on it: plane, relief, clusters, frames, names."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from agent.arm.self_filter import distance_to_arm
from agent.errors import BadInput
from agent.perception.arbitration import DEFAULT, GEOMETRY
from agent.perception.clustering import at_border, bridging
from agent.perception.color import contrast, lab
from agent.perception.description import oriented_box, shape_words
from agent.perception.flat_things import TableView, with_flat_things
from agent.perception.height_map import table_relief
from agent.perception.object_clusters import WIDEST, Points, Tint, find_objects
from agent.perception.seen_colors import color_names, light_of
from agent.perception.segments import ARM, NOTHING, TABLE, Segment, Segments
from agent.perception.supports import supports_of
from agent.perception.table_extent import reachable, seen_rectangle
from agent.perception.table_plane import FARTHEST, TablePlane, on_walls, table_plane
from agent.perception.world_frame import base_from_camera, world_frame
from agent.recordings.recording import Recording
from structdiffusion.geometry import lengths, transform_points

_ARM_CLEARANCE = 0.03  # m about the arm's own model: what is nearer is the arm, its cables, and the noise at its edges
_BELOW = 0.006  # m below what carries it, within which a point is an object's still
_TABLE_BAND = 4.0  # sigma, or 1 cm: what lies nearer to the table's surface is the table


@dataclass(frozen=True)
class Measurement:
    """A recording in the frame of its table.

    Attributes:
        plane: the table's plane.
        pixels: (P,) the place of each point in the flattened picture, without the arm's and the walls'.
        arm: (A,) the pixels that show the arm.
        points: what objects are found in.
        flat: (P,) whether each point may be of the table's surface.
    """

    plane: TablePlane
    pixels: np.ndarray
    arm: np.ndarray
    points: Points
    flat: np.ndarray


def segment(recording: Recording, method: str = DEFAULT) -> Segments:
    """Find the table and the objects that a recording shows.

    Args:
        recording: the recording.
        method: who tells objects apart, one of `METHODS`; an unorganised cloud is left to geometry.

    Raises:
        BadInput: when nothing was measured, or no table is there.
    """
    frame = recording.frame
    shape = frame.points.shape[:2]
    seen = measurement(recording, method)
    plane, pixels, flat, relief, tint = seen.plane, seen.pixels, seen.flat, seen.points.relief, seen.points.tint
    level = seen.points.level
    labels = np.full(shape[0] * shape[1], NOTHING, dtype=np.int16)
    labels[seen.arm] = ARM
    found = find_objects(seen.points, method)
    if tint is not None and frame.organised:
        view = TableView(level, relief.heights, tint.contrast, pixels, shape, seen.points.eye, relief.outline)
        named = with_flat_things(found.labels, view)
        found = replace(found, labels=named, count=int(named.max(initial=-1)) + 1)
    flat = flat & (found.labels < 0)
    flat[flat] = shapely.contains_xy(relief.outline, level[flat, 0], level[flat, 1])
    labels[pixels[flat]] = TABLE
    middles = np.array([np.median(level[found.labels == k, :2], axis=0) for k in range(found.count)]).reshape(-1, 2)
    outline = np.array(relief.outline.exterior.coords)
    places = middles if found.count else np.array(relief.outline.centroid.coords)
    frames = world_frame(recording, plane.level_from_camera, places)
    world_from_level = frames.world_from_camera @ np.linalg.inv(plane.level_from_camera)
    world = transform_points(world_from_level, level)
    edge = transform_points(world_from_level, np.column_stack((outline, np.zeros(len(outline)))))[:, :2]
    surface = seen_rectangle(edge, world[found.labels >= 0, :2])
    table, notes = reachable(surface)

    # From left to right as the arm sees them.
    order = np.argsort([-world[found.labels == k, 1].mean() for k in range(found.count)])
    number = np.full(found.count + 1, NOTHING)
    number[order] = np.arange(1, found.count + 1)
    inside = found.labels >= 0
    labels[pixels[inside]] = number[found.labels[inside]]
    colors = None if frame.color is None else frame.color.reshape(-1, 3)[pixels]
    return Segments(
        _segments(world.astype(np.float32), colors, [found.labels == k for k in order]),
        table,
        surface,
        frames.world_from_camera,
        frames.world_from_base,
        labels.reshape(shape),
        (
            *frames.notes,
            *notes,
            *_apart(relief.apart, world_from_level),
            *_left_out(found.left_out, world_from_level),
        ),
    )


def measurement(recording: Recording, method: str = DEFAULT) -> Measurement:
    """Find the table's plane and relief in a recording, and let the segmentation network look at it.

    Args:
        recording, method: as `segment` takes them; geometry alone needs no network.

    Raises: as `segment`.
    """
    frame = recording.frame
    shape = frame.points.shape[:2]
    base_from_cam = base_from_camera(recording)
    pixels, points, distance = _measured_points(recording)
    arm_pixels = pixels[:0]
    if base_from_cam is not None and recording.arm is not None:
        arm = distance_to_arm(transform_points(base_from_cam, points), recording.arm) < _ARM_CLEARANCE
        arm_pixels = pixels[arm]
        pixels, points, distance = pixels[~arm], points[~arm], distance[~arm]
    plane = table_plane(points, None if base_from_cam is None else base_from_cam[2, :3])
    level = transform_points(plane.level_from_camera, points)
    kept = ~on_walls(points, plane.walls)
    pixels, distance, level = pixels[kept], distance[kept], level[kept]
    eye = plane.level_from_camera[:3, 3]
    relief = table_relief(level, eye, distance, pixels, shape)
    steep = border = np.zeros(len(pixels), dtype=bool)
    if frame.organised:
        steep, border = bridging(frame.points).ravel()[pixels], at_border(frame.points).ravel()[pixels]
    flat = np.abs(relief.heights) < np.maximum(_TABLE_BAND * relief.sigma, 0.01)
    tint = None
    if frame.color is not None:
        colors = lab(frame.color.reshape(-1, 3)[pixels])
        tint = Tint(colors, contrast(colors, flat, pixels, shape))
    masks = None
    if method != GEOMETRY and frame.organised:
        from agent.perception.network_masks import Sight, network_masks, pixel_pitch
        from agent.segmentation_network.network import shipped_network

        shades = None if tint is None else tint.lab
        sight = Sight(level, relief.heights, eye, pixels, shape, pixel_pitch(frame.points), shades)
        masks = network_masks(sight, shipped_network())
    above_table = np.column_stack((level[:, :2], relief.heights))
    return Measurement(plane, pixels, arm_pixels, Points(above_table, eye, relief, steep, border, tint, masks), flat)


def _measured_points(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the usable points: their pixels (P,), coordinates (P, 3) and distances (P,), float64.

    Raises:
        BadInput: when there are none.
    """
    every = recording.frame.points.reshape(-1, 3)
    distance = lengths(every)
    with np.errstate(invalid="ignore"):
        pixels = np.flatnonzero((distance < FARTHEST) & (distance > 0.0))
    if not len(pixels):
        raise BadInput(
            f"{str(recording.path)!r} has no point to use: of {len(every)} points "
            f"{int(np.isfinite(distance).sum())} were measured, and none within {FARTHEST} m of the camera"
        )
    return pixels, every[pixels].astype(np.float64), distance[pixels].astype(np.float64)


def _apart(surfaces: np.ndarray, world_from_level: np.ndarray) -> list[str]:
    """Return a note for each surface (K, 3) that is as high as the table and no part of it."""
    notes = []
    for x, y, area in surfaces:
        x, y, _ = transform_points(world_from_level, np.array([x, y, 0.0]))
        notes.append(
            f"no object was looked for on a surface of {1e4 * area:.0f} cm2 about x {x:.2f}, y {y:.2f}: it is as high "
            "as the table, but apart from it"
        )
    return notes


def _left_out(wide: np.ndarray, world_from_level: np.ndarray) -> list[str]:
    """Return a note for each cluster (K, 4) that is too wide for an object."""
    notes = []
    for x, y, width, height in wide:
        x, y, _ = transform_points(world_from_level, np.array([x, y, 0.0]))
        notes.append(
            f"left out: what is {width:.2f} m wide and {height:.2f} m high about x {x:.2f}, y {y:.2f} is not an "
            f"object; objects are at most {WIDEST} m wide"
        )
    return notes


def _above(own: np.ndarray, world: np.ndarray, bottom: float) -> np.ndarray:
    """Return which points (P,) of an object are its own: what is below the one that carries it is not.

    At the edge of an object on another, a camera's depth runs over into what is seen beside it.
    """
    return own if bottom <= 0.0 else own & (world[:, 2] > bottom - _BELOW)


def _segments(world: np.ndarray, colors: np.ndarray | None, members: list[np.ndarray]) -> tuple[Segment, ...]:
    """Return the objects with their names."""
    supports = supports_of([world[own] for own in members])
    members = [_above(own, world, on.bottom) for own, on in zip(members, supports, strict=True)]
    boxes = [oriented_box(world[own], on.bottom) for own, on in zip(members, supports, strict=True)]
    shapes = shape_words([sides for _, sides in boxes])
    light = np.ones(3) if colors is None else light_of(colors)
    found = []
    for index, (own, (pose, sides)) in enumerate(zip(members, boxes, strict=True)):
        its = None if colors is None else colors[own]
        shades = () if its is None else color_names(its, light)
        words = [*([" or ".join(shade.word for shade in shades)] if shades else []), *shapes[index]]
        name = f"object {index + 1}"
        on = supports[index]
        carrier = "" if on.carrier is None else f"object {on.carrier + 1}"
        said = ", ".join((name, *words))
        found.append(
            Segment(name, said, world[own], its, pose, sides, carrier, on.bottom, shades, support_seen=on.seen)
        )
    return tuple(found)
