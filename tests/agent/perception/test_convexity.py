"""Surfaces whose valleys are known."""

import numpy as np

from agent.perception.convexity import convex_pieces

SPACING = 0.004


def sheet(along, across, normal, corner, rng):
    """Voxels of a rectangle with sides `along` and `across` from a corner, with a millimetre of noise."""
    one, other = (np.arange(0.0, np.linalg.norm(side), SPACING) / np.linalg.norm(side) for side in (along, across))
    shares = np.stack(np.meshgrid(one, other), axis=-1).reshape(-1, 2)
    points = np.asarray(corner) + shares @ np.array([along, across])
    return points + rng.normal(0.0, 0.0005, (len(points), 1)) * normal, np.tile(normal, (len(points), 1)).astype(float)


def joint(*sheets):
    return np.vstack([points for points, _ in sheets]), np.vstack([normals for _, normals in sheets])


def test_a_valley_divides_and_a_ridge_does_not():
    rng = np.random.default_rng(0)
    top = sheet((0, 0.1, 0), (0.08, 0, 0), (0, 0, 1), (0, 0, 0.05), rng)
    front = sheet((0, 0.1, 0), (0, 0, 0.05), (-1, 0, 0), (0, 0, 0), rng)
    wall = sheet((0, 0.1, 0), (0, 0, 0.08), (-1, 0, 0), (0.08, 0, 0.05), rng)
    assert convex_pieces(*joint(top, front), 0.008).max() == 0
    pieces = convex_pieces(*joint(top, front, wall), 0.008)
    box, upper = pieces[: len(top[0]) + len(front[0])], pieces[len(top[0]) + len(front[0]) :]
    assert pieces.max() == 1
    assert (box == box[0]).mean() > 0.95 and (upper == upper[-1]).mean() > 0.95 and box[0] != upper[-1]


def test_an_overhang_divides_two_faces_of_one_direction():
    rng = np.random.default_rng(0)
    lower = sheet((0, 0.08, 0), (0, 0, 0.06), (-1, 0, 0), (0.0, 0, 0), rng)
    upper = sheet((0, 0.08, 0), (0, 0, 0.06), (-1, 0, 0), (-0.02, 0, 0.062), rng)
    even = sheet((0, 0.08, 0), (0, 0, 0.06), (-1, 0, 0), (0.0, 0, 0.062), rng)
    assert convex_pieces(*joint(lower, upper), 0.024).max() == 1
    assert convex_pieces(*joint(lower, even), 0.024).max() == 0


def test_a_round_wall_is_one_piece_from_outside():
    angle, height = np.meshgrid(np.linspace(0.0, np.pi, 40), np.arange(0.0, 0.1, SPACING))
    normals = np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=-1).reshape(-1, 3)
    points = 0.05 * normals + np.outer(height.ravel(), (0, 0, 1))
    assert convex_pieces(points, normals, 0.008).max() == 0
    assert convex_pieces(points, -normals, 0.008).max() > 0
