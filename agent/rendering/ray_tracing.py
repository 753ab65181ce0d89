"""Trace pictures of a table, its surroundings and the bodies on it, in soft light and with smooth edges.

What never moves (floor, table, pedestal) is traced once. For each picture only the pixels that a body may cover are
traced again, and the light that bodies keep from the table and the floor is computed on these planes. Rays are cast by
Embree through Open3D. Lengths in metres, world frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from agent.rendering.furniture import FLOOR, TOP_FACES, furniture
from agent.rendering.plane_light import KEY, LAMP, LIFT, SKY, LitPlane, lamp_points
from agent.rendering.surfaces import BOX_SIDES, Surface, box
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

_MIDDLE = np.array([[0.5, 0.5]], dtype=np.float32)  # of a pixel: column, row
# Rays through an edge: in other columns and rows each, so that steep and flat edges have five shades.
_WITHIN = np.array([[0.375, 0.125], [0.875, 0.375], [0.625, 0.875], [0.125, 0.625]], dtype=np.float32)
_ROWS = 60  # of the picture that are traced at once where nothing moves
_TABLE_SQUARE, _FLOOR_SQUARE = 0.008, 0.05  # of the light on them
_FLOOR_REACH = 0.9  # m around the table within which the floor has shadows
_FLOOR_GLOW = 0.55  # share of the light that the floor has in any shadow, as in a bright room
_SHINE = 30  # exponent of highlights
_NEAR_FLOOR, _FAR_FLOOR = (0.78, 0.80, 0.83), (0.90, 0.905, 0.915)
_FADES = (1.0, 3.4)  # m from the camera: where the floor begins to fade, and where it has faded
_STEP, _BEND = 0.012, 0.9  # m, cosine: a larger step or turn between neighbouring pixels is an edge
_FAR = 100.0  # m: the depth of pixels without a body
_MARGIN = 0.005  # m around the box of a body, some pixels: an edge is looked for there


@dataclass(frozen=True, eq=False)
class _Seen:
    """What rays meet. `there` (K,) tells which meet a body; of these M, in order:

    rays (M, 3) from the eye, along (M,) how far the body is along them, number (M,) of its face, normal (M, 3) there.
    """

    there: np.ndarray
    rays: np.ndarray
    along: np.ndarray
    number: np.ndarray
    normal: np.ndarray


_Part = tuple[np.ndarray, np.ndarray, np.ndarray]  # pixels (K,), places (K, 2) on a plane, paint (K, 3)


class Stage:
    """A table with its surroundings and the bodies that move on it, as one camera sees them.

    Args:
        camera: the camera.
        ground: the table's whole surface, at z = 0.
        base: (3,) where an arm stands; without it, or if it is on the table, there is no pedestal.
        surfaces: of the bodies.
    """

    def __init__(
        self, camera: DepthCamera, ground: Table, base: Sequence[float] | None, surfaces: Sequence[Surface]
    ) -> None:
        self._camera, self._bodies = camera, _Meshes(surfaces)
        self._still = _Meshes(furniture(ground, base))
        self._eye = camera.world_from_camera[:3, 3].astype(np.float32)
        self._corner, self._right, self._down = _raster(camera)
        reach = Table(
            ground.x_min - _FLOOR_REACH, ground.x_max + _FLOOR_REACH,
            ground.y_min - _FLOOR_REACH, ground.y_max + _FLOOR_REACH,
        )  # fmt: skip
        self._planes = (LitPlane(ground, 0.0, _TABLE_SQUARE), LitPlane(reach, FLOOR, _FLOOR_SQUARE, _FLOOR_GLOW))
        self._lamp = lamp_points(len(_WITHIN)).astype(np.float32)
        self._paint_still()

    def picture(self, world_from_bodies: Sequence[np.ndarray]) -> np.ndarray:
        """Return a picture (H, W, 3) uint8 with each body at its pose (4, 4)."""
        height, width = self._camera.height, self._camera.width
        vertices, normals = self._bodies.moved(world_from_bodies)
        scene = _scene(
            np.concatenate((self._still.vertices, vertices)),
            np.concatenate((self._still.faces, self._bodies.faces + np.uint32(len(self._still.vertices)))),
        )
        image = self._base.copy()
        for plane, (pixels, bright_of, paint) in zip(self._planes, self._parts, strict=True):
            image[pixels] += (bright_of @ plane.light(scene).ravel())[:, None] * paint
        pixels = self._covered(world_from_bodies)
        seen = self._seen(scene, self._rays(pixels, _MIDDLE)[:, 0], normals)
        color = np.zeros((len(pixels), 3), dtype=np.float32)
        color[seen.there] = self._shaded(scene, seen, self._lamp[None])
        share = seen.there.astype(np.float32)
        edges = _edges(seen, pixels, (height, width))
        finer = self._seen(scene, self._rays(pixels[edges], _WITHIN).reshape(-1, 3), normals)
        fine = np.zeros((len(finer.there), 3), dtype=np.float32)
        which = np.flatnonzero(finer.there) % len(_WITHIN)  # each ray of a pixel has a point of the lamp to itself
        fine[finer.there] = self._shaded(scene, finer, self._lamp[which][:, None])
        color[edges] = fine.reshape(-1, len(_WITHIN), 3).mean(axis=1)
        share[edges] = finer.there.reshape(-1, len(_WITHIN)).mean(axis=1)
        image[pixels] = image[pixels] * (1 - share[:, None]) + color
        return np.clip(255 * image + 0.5, 0, 255).astype(np.uint8).reshape(height, width, 3)

    def _seen(self, scene: Any, rays: np.ndarray, normals: np.ndarray) -> _Seen:
        """Return what rays (K, 3) from the eye meet; `normals` (F, 3, 3) are those at the corners of all faces."""
        import open3d

        found = scene.cast_rays(open3d.core.Tensor(self._from_eye(rays)))
        number = found["primitive_ids"].numpy().astype(np.int64) - len(self._still.faces)
        along = found["t_hit"].numpy()
        there = np.isfinite(along) & (number >= 0)
        rays, along, number, second = rays[there], along[there], number[there], found["primitive_uvs"].numpy()[there]
        share = np.concatenate((1 - second.sum(axis=1, keepdims=True), second), axis=1)
        normal = np.einsum("kc,kcd->kd", share, normals[number])
        normal /= np.maximum(np.sqrt(np.einsum("kd,kd->k", normal, normal)), 1e-9)[:, None]
        normal[np.einsum("kd,kd->k", normal, rays) > 0] *= -1
        return _Seen(there, rays, along, number, normal)

    def _rays(self, pixels: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return rays (K, P, 3) through places (P, 2) in pixels (K,), 1 m long along the camera's z."""
        row, column = np.divmod(pixels, self._camera.width)
        columns, rows = column[:, None] + places[:, 0], row[:, None] + places[:, 1]
        return (self._corner + columns[..., None] * self._right + rows[..., None] * self._down).astype(np.float32)

    def _from_eye(self, rays: np.ndarray) -> np.ndarray:
        return np.concatenate((np.broadcast_to(self._eye, rays.shape), rays), axis=1)

    def _shaded(self, scene: Any, seen: _Seen, lamp: np.ndarray) -> np.ndarray:
        """Return the colours (K, 3) of points on bodies.

        Args:
            scene: everything, for shadows.
            seen: the points.
            lamp: (K or 1, L, 3) directions to the points of the lamp that light each of them.
        """
        import open3d

        toward = LAMP.astype(np.float32)
        facing = seen.normal @ toward
        lit = facing > 0
        points = self._eye + seen.along[lit, None] * seen.rays[lit] + 4 * LIFT * seen.normal[lit]
        shape = (len(points), lamp.shape[1], 3)
        directions = np.broadcast_to(lamp if len(lamp) == 1 else lamp[lit], shape)
        rays = np.concatenate((np.broadcast_to(points[:, None], shape), directions), axis=2).reshape(-1, 6)
        free = np.zeros(len(lit), dtype=np.float32)
        free[lit] = 1 - scene.test_occlusions(open3d.core.Tensor(rays)).numpy().reshape(shape[:2]).mean(axis=1)
        half = toward - seen.rays / np.sqrt(np.einsum("kd,kd->k", seen.rays, seen.rays))[:, None]
        half /= np.sqrt(np.einsum("kd,kd->k", half, half))[:, None]
        shine = np.maximum(np.einsum("kd,kd->k", seen.normal, half), 0) ** _SHINE
        bright = KEY * np.maximum(facing, 0) * free + SKY * (0.62 + 0.38 * seen.normal[:, 2])
        gloss = shine * free * self._bodies.gloss[seen.number]
        return self._bodies.paint[seen.number] * bright[:, None] + gloss[:, None]

    def _covered(self, poses: Sequence[np.ndarray]) -> np.ndarray:
        """Return the numbers of the pixels that bodies may cover."""
        camera, placed = self._camera, np.asarray(poses)
        points = np.einsum("bij,bcj->bci", placed[:, :3, :3], self._bodies.corners) + placed[:, None, :3, 3]
        pose = camera.world_from_camera
        if (((points - pose[:3, 3]) @ pose[:3, 2]) < camera.near).any():
            return np.arange(camera.height * camera.width)
        there = Image.new("1", (camera.width, camera.height))
        pen = ImageDraw.Draw(there)
        for ends in camera.pixels(points).round().tolist():
            for side in BOX_SIDES:
                pen.polygon([tuple(ends[corner]) for corner in side], fill=1)
        return np.flatnonzero(np.asarray(there))

    def _paint_still(self) -> None:
        """Trace what never moves: colours of what has its own light, and paint where the light falls on a plane."""
        scene, height, width = _scene(self._still.vertices, self._still.faces), self._camera.height, self._camera.width
        bands = np.array_split(np.arange(height * width), max(1, height // _ROWS))
        base, *parts = zip(*(self._still_band(scene, band) for band in bands), strict=True)
        self._base = np.concatenate(base)
        self._parts = []
        for plane, found in zip(self._planes, parts, strict=True):
            pixels, places, paint = (np.concatenate(each) for each in zip(*found, strict=True))
            self._parts.append((pixels, plane.interpolation(places), paint))

    def _still_band(self, scene: Any, pixels: np.ndarray) -> tuple[np.ndarray, _Part, _Part]:
        """Trace some pixels (K,): their own colours (K, 3), and their parts of the table and of the floor."""
        import open3d

        rays = self._rays(pixels, _WITHIN).reshape(-1, 3)
        found = scene.cast_rays(open3d.core.Tensor(self._from_eye(rays)))
        along, number = found["t_hit"].numpy(), found["primitive_ids"].numpy().astype(np.int64)
        normal = found["primitive_normals"].numpy()
        with np.errstate(divide="ignore", invalid="ignore"):
            to_floor = (FLOOR - self._eye[2]) / rays[:, 2]
        to_floor[~(to_floor > 0)] = np.inf
        on_furniture = along < to_floor
        floor = ~on_furniture & np.isfinite(to_floor)
        points = self._eye + np.where(on_furniture | floor, np.minimum(along, to_floor), 0)[:, None] * rays
        on_table = on_furniture & (normal[:, 2] > 0.5) & (number < TOP_FACES)
        near, far = _FADES
        share = np.clip((np.linalg.norm(points[:, :2] - self._eye[:2], axis=1) - near) / (far - near), 0, 1)[:, None]
        paint = ((1 - share) * np.array(_NEAR_FLOOR) + share * np.array(_FAR_FLOOR)).astype(np.float32)
        paint[on_furniture] = self._still.paint[number[on_furniture]]
        light = np.full(len(rays), KEY * LAMP[2] + SKY, dtype=np.float32)
        own = on_furniture & ~on_table
        light[own] = KEY * np.maximum(normal[own] @ LAMP, 0) + SKY * (0.62 + 0.38 * normal[own, 2])
        base = np.where((on_table | floor)[:, None], 0, paint * light[:, None])
        shape = (len(pixels), len(_WITHIN), 3)
        table, ground = (
            _part(pixels, there.reshape(shape[:2]), points.reshape(shape), paint.reshape(shape))
            for there in (on_table, floor)
        )
        return base.reshape(shape).mean(axis=1, dtype=np.float32), table, ground


def _part(pixels: np.ndarray, there: np.ndarray, points: np.ndarray, paint: np.ndarray) -> _Part:
    """Return the pixels that show a plane, where on it, and its paint, weighted with the share that it covers.

    Args:
        pixels: (K,) the numbers of the pixels.
        there: (K, R) whether a ray meets the plane.
        points, paint: (K, R, 3) the places and the colours of what the rays meet.
    """
    shown = np.flatnonzero(there.any(axis=1))
    weight = there[shown].astype(np.float32)[..., None]
    middle = (points[shown] * weight).sum(axis=1) / weight.sum(axis=1)
    return pixels[shown], middle[:, :2], (paint[shown] * weight).mean(axis=1)


class _Meshes:
    """Surfaces as one mesh.

    Attributes:
        vertices: (V, 3) float32, each in its own body's frame. faces: (F, 3) uint32.
        paint: (F, 3), gloss: (F,) float32 of the faces.
        corners: (bodies, 8, 3) of the box around each.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        self._surfaces = tuple(surfaces)
        firsts = np.cumsum([0, *(len(each.vertices) for each in surfaces)])
        faces = [each.faces + first for each, first in zip(surfaces, firsts, strict=False)]
        sizes = [len(each) for each in faces]
        self.vertices = np.concatenate([each.vertices for each in surfaces]).astype(np.float32)
        self.faces = np.concatenate(faces).astype(np.uint32)
        self.paint = np.repeat([each.color for each in surfaces], sizes, axis=0).astype(np.float32)
        self.gloss = np.repeat([each.gloss for each in surfaces], sizes).astype(np.float32)
        self.corners = np.array(
            [box(each.vertices.min(axis=0) - _MARGIN, each.vertices.max(axis=0) + _MARGIN)[0] for each in surfaces]
        )
        self.body = np.repeat(np.arange(len(faces)), sizes)

    def moved(self, poses: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return the vertices (V, 3) and the normals at the corners (F, 3, 3), float32, with each body at its pose."""
        pairs = list(zip(self._surfaces, poses, strict=True))
        vertices = np.concatenate([transform_points(pose, each.vertices) for each, pose in pairs])
        normals = np.concatenate([each.normals @ pose[:3, :3].T for each, pose in pairs])
        return vertices.astype(np.float32), normals.astype(np.float32)


def _edges(seen: _Seen, pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the places in `pixels` (numbers of pixels of a picture of this shape) where one ray is not enough: a
    neighbour shows no body, one that is farther away, or one that faces another way.
    """
    facing = np.zeros((*shape, 3), dtype=np.float32)
    depth = np.full(shape, _FAR, dtype=np.float32)
    facing.reshape(-1, 3)[pixels[seen.there]] = seen.normal
    depth.reshape(-1)[pixels[seen.there]] = seen.along
    edge = np.zeros(shape, dtype=bool)
    every, later, earlier = slice(None), slice(1, None), slice(None, -1)
    for one, other in (((later, every), (earlier, every)), ((every, later), (every, earlier))):
        differs = np.abs(depth[one] - depth[other]) > _STEP
        differs |= np.einsum("hwd,hwd->hw", facing[one], facing[other]) < np.where(depth[one] < _FAR, _BEND, -1)
        edge[one] |= differs
        edge[other] |= differs
    return np.flatnonzero(edge.reshape(-1)[pixels])


def _scene(vertices: np.ndarray, faces: np.ndarray) -> Any:
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(faces))
    return scene


def _raster(camera: DepthCamera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ray to the picture's upper left corner, and what a column and a row add to it, each (3,)."""
    right, down, forward = camera.world_from_camera[:3, :3].T
    corner = forward - (camera.width / 2 * right + camera.height / 2 * down) / camera.focal
    corner, right, down = (part.astype(np.float32) for part in (corner, right / camera.focal, down / camera.focal))
    return corner, right, down
