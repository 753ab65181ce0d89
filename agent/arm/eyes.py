"""Look at the table while the arm builds, and keep what is known of where everything is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from shapely import MultiPoint, contains_xy
from shapely.geometry.base import BaseGeometry

from agent.arm.hand_fit import FLAT
from agent.arm.placement_order import bottom_at
from agent.arm.registration import judge
from agent.arm.sight import Sight
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.table_camera import TableCamera, in_box
from agent.arm.tracking import Track, Tracker
from structdiffusion.completion.surface import completed_points
from structdiffusion.evaluation_protocol import MAX_TILT
from structdiffusion.geometry import pose_from_xyz_yaw, raised, tilt_between, transform_points, turn_of
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.simulation.depth_camera import CameraImage
from structdiffusion.simulation.visible_points import MIN_POINTS
from structdiffusion.simulation.world import TabletopWorld

STILL, STILL_TURN = 0.006, 0.1  # m, rad: what seems to have moved by less has not; so much is the tracker's noise
LOST = 0.03  # m: what the tracker finds farther off before anything has moved, it cannot follow
DISTINCT = 0.006  # m: three times the camera's noise at the table
MOST = 0.6  # share of the points seen first that show an object where it was
NEARLY_ALL = 0.85  # the same, of one that stands there: what leans covers most of the same place
BESIDE = 0.01  # m around what is known, where points that it does not explain are its own: a handle, a rim
ALIKE = 0.3  # of the share that the picture supports: ends that differ by less may be taken for one another
TIPPED = 0.08  # m between where the foot of something stood and where it is when it was tipped over: half a bottle
SAME_HEIGHT = 0.015  # m by which the top of what stands may seem to be off
ON_TABLE = 0.01  # m: what seems to stand higher by less stands on the table
LYING = np.pi / 4  # rad: what is tilted by more has fallen over
ON_SIDE = "may lie on its side, which looks the same"
ON_HEAD = "may stand on its head, which looks the same"
AWAY = pose_from_xyz_yaw(-5.0, 0.0, 0.0, 0.0)  # where planning takes what is gone to be: far from everything


class Eyes:
    """The only source of where things are while the arm builds: pictures of the depth camera, and their tracker.

    What moved by no more than the tracker's noise keeps its place, so that plans stay valid. What the picture hides is
    taken to be where it was, or where it was just placed. What the tracker does not find in its first picture, when
    nothing has moved yet, it cannot follow: that is taken to be where it is expected.

    Args:
        world: takes the pictures.
        arm: is masked in them.
        scene: what was seen before anything moved.
        solid: the same with the hidden sides of the objects (`completed_scene`).
        rng: draws the sensor's noise.

    Attributes:
        scene: as given.
        camera: takes the pictures.
        count: the number of its objects; the distractors follow them in every list.
        clouds: (P, 3) of each, as it was seen first.
        motions: now_from_initial (4, 4) of each, as far as known.
        measured: the same as the last picture that showed it has it, noise and all.
        gone: those that are not on the table any more.
        hidden: those that the last picture does not show.
        unconfirmed: those that were placed where no picture has shown them since.
        unclear: those that lie, and of which the camera cannot tell one end from the other.
        doubts: why some that are seen upright may not be, in words that follow their names.
        unknown: (P, 3) of each thing that has appeared and belongs to nothing known.
    """

    def __init__(
        self, world: TabletopWorld, arm: SimulatedArm, scene: Scene, solid: Scene, rng: np.random.Generator
    ) -> None:
        self.camera, self._lens, self.scene = TableCamera(world, arm, rng), world.camera, scene
        every = (*scene.objects, *scene.distractors)
        self.names = [cloud.name for cloud in every]
        self.count = len(scene.objects)
        self.clouds = [np.asarray(cloud.points, dtype=np.float64) for cloud in every]
        hidden = (completed_points(cloud, scene.world_from_camera) for cloud in scene.distractors)
        self._solids = [*(cloud.points for cloud in solid.objects), *hidden]
        self._middles = [0.5 * (points.min(axis=0) + points.max(axis=0)).astype(np.float64) for points in self._solids]
        self._bottoms = [cloud.bottom for cloud in every]
        self.motions: list[np.ndarray] = [np.eye(4) for _ in every]
        self.measured = list(self.motions)
        self.gone, self.hidden, self.unclear = frozenset[int](), frozenset[int](), frozenset[int]()
        self.unconfirmed, self.doubts = frozenset[int](), dict[int, str]()
        self.unknown: list[np.ndarray] = []
        self._tracker = Tracker(scene)
        picture = self.camera.picture()
        # A fit may be off a little from the beginning, by what completion errs; all motions are counted from there.
        self._first = [np.eye(4) for _ in every]
        tracks = self._tracker.look(picture)
        self._untracked = frozenset(k for k, track in enumerate(tracks) if track.gone or self._apart(k, track) > LOST)
        # Of what was half hidden, the body is so far from the truth that it fits as well on its side.
        self._doubtful = frozenset(k for k, track in enumerate(tracks) if _tilt(track.now_from_initial) > MAX_TILT)
        for k, track in enumerate(tracks):
            if track.seen and k not in self._doubtful and self._apart(k, track) > STILL:
                self._first[k] = track.now_from_initial
        self._unexplained = list(self._tracker.unknown)  # it was there from the beginning

    def look(self, expected: Mapping[int, np.ndarray], dropped: int | None = None) -> None:
        """Take a picture and find everything in it.

        Args:
            expected: index -> now_from_initial (4, 4) of what the arm has moved since the last picture.
            dropped: what has fallen out of the hand since then.
        """
        picture = self.camera.picture()
        given = {k: motion @ self._first[k] for k, motion in expected.items()}
        tracks = self._tracker.look(picture, given)
        gone, hidden, unclear = set[int](), set[int](), set(self.unclear)
        for k, track in enumerate(tracks):
            before, was_gone = expected.get(k, self.motions[k]), k in self.gone
            self.motions[k] = self.measured[k] = before
            from_first = np.linalg.inv(self._first[k])
            now = track.now_from_initial @ from_first
            fallen = track.seen and tilt_between(now, before) > MAX_TILT
            share = self._shown(picture, k) if not was_gone and (track.gone or fallen) else 0.0
            if k in self._untracked or share > (MOST if track.gone else NEARLY_ALL):
                continue
            if not track.seen:
                (gone if track.gone or was_gone else hidden).add(k)  # what hides its place does not bring it back
                continue
            if fallen and self._seems_upright(picture, k, now, before):
                now, fallen = raised(before, 0.0), False
                now[:2, 3] += self._way(k, before, track.now_from_initial @ from_first)[:2]  # it is as high as before
            if fallen and k not in unclear and tilt_between(now, before) > LYING:
                now, clear = self._with_foot(picture, k, now, before, k == dropped)
                if not clear:
                    unclear.add(k)
                    self.doubts[k] = ON_HEAD
            elif not fallen and _tilt(now) < MAX_TILT:
                unclear.discard(k)
            if not fallen and (was_gone or k == dropped or self._may_have_rolled(k, now, before)):
                self._doubt(k, k == dropped or self._has_sunk(k, now, before))
            self.measured[k] = now
            if was_gone or self._strays(k, now):
                self.motions[k] = now
        self.gone, self.hidden, self.unclear = frozenset(gone), frozenset(hidden), frozenset(unclear)
        self.unconfirmed = (self.unconfirmed | expected.keys()) & self.hidden
        self.unknown = list(self._strangers())

    def _strangers(self) -> Iterator[np.ndarray]:
        """Yield the clouds (P, 3) of what was not there at first and belongs to nothing known.

        What lies beside that may be a side of it that was not seen; what is on it is none.
        """
        here = [k for k in range(len(self.names)) if k not in self.gone]
        around = [(self.outline(k).buffer(BESIDE), float(self.cloud(k)[:, 2].max()) + BESIDE) for k in here]
        for cloud in self._tracker.unknown:
            own = (contains_xy(outline, cloud[:, :2]) & (cloud[:, 2] < top) for outline, top in around)
            strange = ~np.any([*own, np.zeros(len(cloud), dtype=bool)], axis=0)
            if strange.mean() > 0.5 and not is_among(cloud, self._unexplained):
                yield cloud[strange]

    def _doubt(self, k: int, fell: bool) -> None:
        """Doubt whether something is upright that has been moved and looks the same otherwise."""
        if self._tracker.may_be_rolled(k, on_head=False):
            self.doubts[k] = ON_SIDE
        elif fell and self._tracker.may_be_rolled(k, on_head=True):
            self.doubts[k] = ON_HEAD

    def _may_have_rolled(self, k: int, now: np.ndarray, before: np.ndarray) -> bool:
        """Return whether something is so far from where it was or was put that it may have rolled over on the way: by
        half its width.
        """
        apart = np.linalg.norm(self.middle(k, now) - self.middle(k, before))
        return bool(apart > max(STILL, 0.5 * np.ptp(self.clouds[k][:, :2], axis=0).min()))

    def _has_sunk(self, k: int, now: np.ndarray, before: np.ndarray) -> bool:
        """Return whether something has fallen off something, and may have rolled over twice."""
        return bool((self.middle(k, before) - self.middle(k, now))[2] > SAME_HEIGHT)

    def _seems_upright(self, picture: CameraImage, k: int, now: np.ndarray, before: np.ndarray) -> bool:
        """Return whether what a track takes to have fallen over may as well stand: it is as high as before, or flat.

        Args:
            now: (4, 4) the motion of the track.
            before: (4, 4) the one by which it would stand upright.
        """
        cloud = self.clouds[k]
        if k in self._doubtful or np.ptp(cloud[:, 2]) < FLAT:  # both sides of what is flat look alike
            return True
        if tilt_between(now, before) < LYING:  # what leans is about as high as what stands
            return False
        middle, seen = self.middle(k, now), picture.points.reshape(-1, 3)
        near = 0.4 * min(np.ptp(cloud[:, 0]), np.ptp(cloud[:, 1]))
        high = seen[np.hypot(*(seen[:, :2] - middle[:2]).T) < near, 2]
        if len(high) < MIN_POINTS:
            return False
        top = float(np.percentile(high, 98))
        shape = self._tracker.shapes[k]
        upright = float(transform_points(before, cloud)[:, 2].max())
        lying = float(transform_points(now @ self._first[k] @ shape.world_from_shape, shape.samples)[:, 2].max())
        return abs(top - upright) < min(SAME_HEIGHT, abs(top - lying))

    def _with_foot(
        self, picture: CameraImage, k: int, now: np.ndarray, before: np.ndarray, fell: bool
    ) -> tuple[np.ndarray, bool]:
        """Return the motion (4, 4) of something that lies, and whether it is clear which of its ends is the foot.

        Where both ends look alike, what was tipped over has its foot near where it stood.

        Args:
            now: (4, 4) the motion of its track.
            before: (4, 4) how it stood.
            fell: whether it fell out of the hand, and was not tipped over.
        """
        shape, sight = self._tracker.shapes[k], Sight(picture, self.scene.table)
        from_shape = self._first[k] @ shape.world_from_shape
        x, y, _ = transform_points(now @ from_shape, shape.samples.mean(axis=0)).tolist()
        turned = pose_from_xyz_yaw(x, y, 0.0, math.pi) @ pose_from_xyz_yaw(-x, -y, 0.0, 0.0) @ now
        shares = [judge(sight, shape, motion @ from_shape).evidence.share for motion in (now, turned)]
        if fell or shares[1] < shares[0] - ALIKE:
            return now, shares[1] < shares[0] - ALIKE
        foot = np.array([*self.clouds[k][:, :2].mean(axis=0), self._bottoms[k]])
        stood = transform_points(before, foot)
        away = [float(np.linalg.norm((transform_points(motion, foot) - stood)[:2])) for motion in (now, turned)]
        if min(away) < min(TIPPED, 0.5 * max(away)):  # of what is as wide as high, both ends are about as near
            return (now, turned)[int(np.argmin(away))], True
        return now, False

    def _shown(self, picture: CameraImage, k: int) -> float:
        """Return the share of the points seen first that a picture shows just where something is taken to be.

        The tracker's bodies are completed by guess; where what stood on one has been taken away, the guess may not fit.
        """
        points = self.cloud(k)
        points = points[points[:, 2] > self.bottom(k) + DISTINCT]
        columns, rows = np.floor(self._lens.pixels(points)).astype(int).T
        inside = (columns >= 0) & (columns < self._lens.width) & (rows >= 0) & (rows < self._lens.height)
        away = (points - picture.world_from_camera[:3, 3]) @ picture.world_from_camera[:3, 2]
        behind = picture.depth[rows[inside], columns[inside]] - away[inside]
        agree, refuted = (np.abs(behind) < DISTINCT).sum(), (behind >= DISTINCT).sum()
        return float(agree / (agree + refuted)) if agree >= MIN_POINTS else 0.0

    def _apart(self, k: int, track: Track) -> float:
        """Return how far a track is from where something is taken to be, metres."""
        return float(np.linalg.norm(self._way(k, self.motions[k], track.now_from_initial)))

    def _way(self, k: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return the way (3,) from where one motion (4, 4) takes what was seen of something to where another does: the
        rest of it may be completed wrongly, which matters where a motion turns it.
        """
        seen = self.clouds[k].mean(axis=0)
        return transform_points(end, seen) - transform_points(start, seen)

    def _strays(self, k: int, now: np.ndarray) -> bool:
        """Return whether a motion (4, 4) differs from what is known by more than noise."""
        known = self.motions[k]
        apart = np.linalg.norm(self.middle(k, now) - self.middle(k, known))
        return bool(apart > STILL or turn_of(known[:3, :3].T @ now[:3, :3]) > STILL_TURN)

    # --- what follows from it ----------------------------------------------------------------

    def middle(self, k: int, motion: np.ndarray) -> np.ndarray:
        """Return where a motion (4, 4) takes the middle (3,) of something: of all of it, so that what is round may be
        turned.
        """
        return transform_points(motion, self._middles[k])

    def cloud(self, k: int) -> np.ndarray:
        """Return the points (P, 3) of something where it is now; far away if it is gone."""
        return self._now(k, self.clouds[k])

    def solid(self, k: int) -> np.ndarray:
        """Return the points (P, 3) of something where it is now, with those of its hidden sides."""
        return self._now(k, np.asarray(self._solids[k], dtype=np.float64))

    def _now(self, k: int, cloud: np.ndarray) -> np.ndarray:
        return transform_points(AWAY if k in self.gone else self.motions[k], cloud)

    def bottom(self, k: int) -> float:
        """Return z of what something stands on now."""
        motion = self.motions[k]
        if k in self.gone:
            return 0.0
        if _tilt(motion) > LYING:
            low = float(self.cloud(k)[:, 2].min())
        else:
            low = bottom_at(motion, self.clouds[k], self._bottoms[k])
        return low if low > ON_TABLE else 0.0

    def outline(self, k: int) -> BaseGeometry:
        """Return the outline of something, seen from above."""
        return MultiPoint(self.cloud(k)[:, :2]).convex_hull

    def pose(self, k: int) -> np.ndarray:
        """Return the pose (4, 4) of a frame that stood upright in the middle of what was seen first of something, at
        the height of what it stood on.
        """
        middle = self.clouds[k].mean(axis=0)
        return self.motions[k] @ pose_from_xyz_yaw(middle[0], middle[1], self._bottoms[k], 0.0)

    def scene_now(self, solid: bool = False) -> Scene:
        """Return the scene as it is now: the same objects, and as distractors also what has appeared.

        Args:
            solid: with points of the hidden sides of the objects too, to take them by.
        """
        clouds = [*self._solids[: self.count], *self.clouds[self.count :]] if solid else self.clouds
        every = [
            replace(cloud, points=self._now(k, clouds[k]).astype(np.float32), bottom=self.bottom(k))
            for k, cloud in enumerate((*self.scene.objects, *self.scene.distractors))
        ]
        appeared = [
            ObjectCloud(f"something {number}", "object", one.astype(np.float32))
            for number, one in enumerate(self.unknown, start=1)
        ]
        others = [one for k, one in enumerate(every) if k >= self.count and k not in self.gone]
        return replace(self.scene, objects=tuple(every[: self.count]), distractors=(*others, *appeared))


def _tilt(motion: np.ndarray) -> float:
    """Return by how much a motion (4, 4) tilts what stood upright, radians."""
    return tilt_between(motion, np.eye(4))


def is_among(cloud: np.ndarray, others: list[np.ndarray]) -> bool:
    """Return whether a cloud (P, 3) covers the middle of any of others, or the other way round."""
    return any(
        in_box(a.mean(axis=0)[None], np.stack((b.min(axis=0), b.max(axis=0))))[0]
        for other in others
        for a, b in ((cloud, other), (other, cloud))
    )
