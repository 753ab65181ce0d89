"""The contract's semantic checks: is what stands on the table what was asked for?

Pure geometry. It is used on true models after physics (the verdict), and on imagined scenes whose
footprints are estimated from partial clouds (a score for ranking).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from grounding.spec import SHAPES, SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.footprints import (
    SIZE_BANDS,
    centre_range,
    clear_gap,
    fit_circle,
    separation_along,
    tightest_ring_radius,
)
from structdiffusion.geometry import HEADING_OF_ROTATION, wrap_angle
from structdiffusion.observation import Table
from structdiffusion.tableware import BASES, CUTLERY, DRINKWARE

FAILURE_CLASSES = ("intersection", "abnormal velocity", "not upright", "semantic")
OFF_LINE = 0.02  # m from a line that its centroids may be


@dataclass(frozen=True)
class PlacedBody:
    """One object of a finished structure, in the world frame, metres.

    Attributes:
        name: what reports call it.
        category: its noun.
        footprint: (K, 2) convex outline, counter-clockwise.
        centroid: (2,) the footprint's area centroid.
        z_bottom: its lowest z.
        z_top: its highest z.
        front_yaw: the heading of its front (+x of the object frame).
        rests_on: indices of the bodies that carry it; () is the table.
    """

    name: str
    category: str
    footprint: np.ndarray
    centroid: np.ndarray
    z_bottom: float
    z_top: float
    front_yaw: float
    rests_on: tuple[int, ...] = ()

    @property
    def local_footprint(self) -> np.ndarray:
        """The outline about the centroid."""
        return self.footprint - self.centroid


@dataclass(frozen=True)
class Check:
    """One condition of the contract: its name, whether it held, what was measured and what was allowed."""

    name: str
    passed: bool
    measured: float
    limit: str


def allowed_off_ring(radius: float) -> float:
    """How far, metres, a centroid may be from a ring of this radius."""
    return max(0.02, 0.15 * radius)


def allowed_unevenness(mean_gap: float) -> float:
    """How much, metres, the clear gaps of a line may differ from their mean."""
    return max(0.5 * mean_gap, 0.015)


def check_structure(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    """Every check that the spec asks for. With an open shape: those of the shape that passes the most.

    Args:
        bodies: the N objects that take part, at rest.
        spec: what was asked for.
        table: the table's rectangle.
    """
    if spec.shape is not None:
        return _CHECKS[spec.shape](bodies, spec, table)
    options = []
    for shape in SHAPES:
        if all(slot in SLOTS_OF_SHAPE[shape] for slot, _ in spec.tokens()):
            options.append(_CHECKS[shape](bodies, StructureSpec(**{**spec.to_dict(), "shape": shape}), table))
    return max(options, key=lambda checks: sum(check.passed for check in checks) / len(checks))


def structure_centre(bodies: Sequence[PlacedBody], shape: str) -> np.ndarray:
    """The point (2,) whose place the position slots speak of: of the ring, between the line's ends, under the tower,
    or of the setting's base."""
    points = np.array([body.centroid for body in bodies])
    if shape == "circle" and len(bodies) >= 3:
        return fit_circle(points)[0]
    if shape == "line":
        direction = np.linalg.svd(points - points.mean(axis=0))[2][0]
        along = points @ direction
        return 0.5 * (points[along.argmin()] + points[along.argmax()])
    if shape == "tower":
        return points[min(range(len(bodies)), key=lambda i: bodies[i].z_bottom)]
    bases = [i for noun in BASES for i, body in enumerate(bodies) if body.category == noun]
    return points[bases[0]] if shape == "table setting" and bases else points.mean(axis=0)


def _check_circle(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    checks = [Check("objects in the circle", len(bodies) >= 3, len(bodies), ">= 3")]
    if len(bodies) < 3:
        return checks
    points = np.array([body.centroid for body in bodies])
    centre, radius = fit_circle(points)
    offsets = points - centre
    worst = float(np.abs(np.linalg.norm(offsets, axis=1) - radius).max())
    allowed = allowed_off_ring(radius)
    checks.append(Check("distance to the circle (m)", worst <= allowed, worst, f"<= {allowed:.3f}"))

    angles = np.sort(np.arctan2(offsets[:, 1], offsets[:, 0]))
    gaps = np.diff(np.append(angles, angles[0] + 2 * math.pi))
    largest = int(gaps.argmax())
    if spec.rotation is None:
        ratio = float(gaps[largest] / gaps.mean())
        checks.append(Check("largest gap / mean gap", ratio <= 1.6, ratio, "<= 1.6"))
    else:
        ratio = float(gaps[largest] / max(np.delete(gaps, largest).mean(), 1e-9))
        checks.append(Check("opening / mean of the other gaps", 1.5 <= ratio <= 3.0, ratio, "1.5 to 3"))
        middle = angles[largest] + gaps[largest] / 2
        checks.append(_heading_check("opening's heading (deg off)", middle, spec.rotation, 45.0))
    directions = offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
    tightest = tightest_ring_radius([body.local_footprint for body in bodies], directions)
    # Objects in a straight line lie on a circle of any size, all in one direction from its centre.
    checks += _size_check(radius / max(tightest, 1e-9), spec)
    checks.append(_on_table_only(bodies))
    return checks + _position_checks(bodies, centre, spec, table)


def _check_line(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    checks = [Check("objects in the line", len(bodies) >= 2, len(bodies), ">= 2")]
    if len(bodies) < 2:
        return checks
    points = np.array([body.centroid for body in bodies])
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle)[2][0]
    along = (points - middle) @ direction
    across = (points - middle) @ np.array([-direction[1], direction[0]])
    worst = float(np.abs(across).max())
    checks.append(Check("distance to the line (m)", worst <= OFF_LINE, worst, f"<= {OFF_LINE:.3f}"))

    order = np.argsort(along)
    neighbours = [(bodies[i], bodies[j]) for i, j in zip(order, order[1:])]
    gaps = np.array([clear_gap(a.footprint, b.footprint) for a, b in neighbours])
    uneven, allowed = float(np.abs(gaps - gaps.mean()).max()), allowed_unevenness(float(gaps.mean()))
    checks.append(Check("gap off the mean gap (m)", uneven <= allowed, uneven, f"<= {allowed:.3f}"))
    checks.append(_on_table_only(bodies))
    if spec.rotation is not None:
        heading = HEADING_OF_ROTATION[spec.rotation]
        sine = abs(float(direction @ (math.cos(heading), math.sin(heading))))
        off = math.degrees(math.asin(min(1.0, sine)))
        checks.append(Check("line off perpendicular to its heading (deg)", off <= 22.5, off, "<= 22.5"))
    tightest = sum(separation_along(a.local_footprint, b.local_footprint, direction) for a, b in neighbours)
    checks += _size_check(float(along.max() - along.min()) / tightest, spec)
    return checks + _position_checks(bodies, structure_centre(bodies, "line"), spec, table)


def _check_tower(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    checks = [Check("objects in the tower", len(bodies) >= 2, len(bodies), ">= 2")]
    if len(bodies) < 2:
        return checks
    order = sorted(range(len(bodies)), key=lambda i: bodies[i].z_bottom)
    chained = sum(tuple(bodies[upper].rests_on) == (lower,) for lower, upper in zip(order, order[1:]))
    chained += bodies[order[0]].rests_on == ()
    checks.append(Check("objects that rest on the next one below only", chained == len(bodies), chained, f"{len(bodies)}"))
    centred = sum(
        shapely.Polygon(bodies[lower].footprint).contains(shapely.Point(bodies[upper].centroid))
        for lower, upper in zip(order, order[1:])
    )
    checks.append(
        Check("objects whose centroid lies over the one below", centred == len(bodies) - 1, centred, f"{len(bodies) - 1}")
    )
    return checks + _position_checks(bodies, structure_centre(bodies, "tower"), spec, table)


def _check_table_setting(bodies: Sequence[PlacedBody], spec: StructureSpec, table: Table) -> list[Check]:
    bases = [i for noun in BASES for i, body in enumerate(bodies) if body.category == noun]
    checks = [
        Check("plates or bowls as a base", bool(bases), len(bases), ">= 1"),
        Check("objects in the setting", len(bodies) >= 2, len(bodies), ">= 2"),
    ]
    if not bases or len(bodies) < 2:
        return checks
    base = bases[0]
    fronts = [body.front_yaw for body in bodies if body.category in CUTLERY]
    if fronts:  # cutlery points away from the diner, so the diner is where it points from
        facing = math.atan2(-sum(map(math.sin, fronts)), -sum(map(math.cos, fronts)))
        sides = _diner_checks(bodies, base, facing)
    else:
        candidates = np.arange(-math.pi, math.pi, math.radians(5))
        if spec.rotation is not None:
            off = np.abs(wrap_angle(candidates - HEADING_OF_ROTATION[spec.rotation]))
            candidates = candidates[np.argsort(off)]
        facing = max(candidates, key=lambda yaw: sum(check.passed for check in _diner_checks(bodies, base, yaw)))
        sides = _diner_checks(bodies, base, facing)
    checks += sides
    on_plate = [body for body in bodies if base in body.rests_on and body.category != "bowl"]
    checks.append(Check("things on the plate other than a bowl", not on_plate, len(on_plate), "0"))
    loneliest = max(
        min(clear_gap(a.footprint, b.footprint) for j, b in enumerate(bodies) if j != i) for i, a in enumerate(bodies)
    )
    checks.append(Check("clear gap to the nearest neighbour (m)", loneliest <= 0.08, loneliest, "<= 0.080"))
    if spec.rotation is not None:
        checks.append(_heading_check("setting's heading (deg off)", facing, spec.rotation, 22.5))
    return checks + _position_checks(bodies, structure_centre(bodies, "table setting"), spec, table)


def _diner_checks(bodies: Sequence[PlacedBody], base: int, facing: float) -> list[Check]:
    """Which side everything is on, for a diner who sits toward the heading `facing` and looks at the plate."""
    away = -np.array([math.cos(facing), math.sin(facing)])
    left = np.array([-away[1], away[0]])
    plate = bodies[base].footprint - bodies[base].centroid
    left_edge, right_edge = float((plate @ left).max()), float((plate @ left).min())
    knives = [body for body in bodies if body.category == "knife"]
    checks = []
    for i, body in enumerate(bodies):
        if i == base:
            continue
        offset = body.centroid - bodies[base].centroid
        side, behind = float(offset @ left), float(offset @ away)
        if body.category == "fork":
            checks.append(Check(f"{body.name}: left of the plate (m)", side > left_edge, side, f"> {left_edge:.3f}"))
        elif body.category == "knife":
            checks.append(Check(f"{body.name}: right of the plate (m)", side < right_edge, side, f"< {right_edge:.3f}"))
        elif body.category == "spoon":
            knife_side = [float((knife.centroid - bodies[base].centroid) @ left) for knife in knives]
            edge = min([right_edge, *knife_side])
            checks.append(Check(f"{body.name}: right of knife and plate (m)", side < edge, side, f"< {edge:.3f}"))
        elif body.category in DRINKWARE:
            checks.append(Check(f"{body.name}: right of the centre (m)", side < 0, side, "< 0"))
            checks.append(Check(f"{body.name}: behind the centre (m)", behind > 0, behind, "> 0"))
        elif body.category == "bowl" and base not in body.rests_on:
            checks.append(Check(f"{body.name}: left of the centre (m)", side > 0, side, "> 0"))
            checks.append(Check(f"{body.name}: behind the centre (m)", behind > 0, behind, "> 0"))
        if body.category in CUTLERY:
            off = abs(math.degrees(wrap_angle(body.front_yaw - math.atan2(away[1], away[0]))))
            checks.append(Check(f"{body.name}: points away from the diner (deg off)", off <= 15, off, "<= 15"))
    return checks


def _heading_check(name: str, measured_yaw: float, rotation: str, limit_degrees: float) -> Check:
    off = abs(math.degrees(wrap_angle(measured_yaw - HEADING_OF_ROTATION[rotation])))
    return Check(name, off <= limit_degrees, off, f"<= {limit_degrees:g}")


def _size_check(ratio: float, spec: StructureSpec) -> list[Check]:
    if spec.size is None:
        return []
    low, high = SIZE_BANDS[spec.size]
    limit = f"< {high:g}" if low == 0 else f">= {low:g}" + ("" if math.isinf(high) else f" and < {high:g}")
    return [Check("extent / tightest extent", low <= ratio < high, ratio, limit)]


def _on_table_only(bodies: Sequence[PlacedBody]) -> Check:
    stacked = sum(body.rests_on != () for body in bodies)
    return Check("objects on top of others", stacked == 0, stacked, "0")


def _position_checks(
    bodies: Sequence[PlacedBody], centre: np.ndarray, spec: StructureSpec, table: Table
) -> list[Check]:
    """Thirds of the range in which the centre can lie with everything on the table; left is +y, top is +x."""
    ranges = centre_range([body.footprint for body in bodies], centre, table)
    checks = []
    for value, axis, names in (
        (spec.x_position, 1, ("right", "center", "left")),
        (spec.y_position, 0, ("bottom", "middle", "top")),
    ):
        if value is not None:
            low, high = ranges[axis]
            # A structure as wide as the table has no range: its centre counts as the middle of it.
            share = (centre[axis] - low) / (high - low) if high - low > 1e-6 else 0.5
            third = names.index(value)
            passed = third / 3 <= share <= (third + 1) / 3
            checks.append(
                Check(f"{value}: place in the range", passed, float(share), f"{third / 3:.2f} to {(third + 1) / 3:.2f}")
            )
    return checks


_CHECKS = {
    "circle": _check_circle,
    "line": _check_line,
    "tower": _check_tower,
    "table setting": _check_table_setting,
}
