import numpy as np
import pytest
from scipy.spatial import ConvexHull

from structdiffusion.objects.model import footprint_centroid
from structdiffusion.objects.procedural import KINDS, procedural_object, procedural_objects
from structdiffusion.objects.solids import assemble, box, circle_outline, frustum, prism, sample_surface, shell


def solid(*parts: np.ndarray, density: float = 500.0):
    return assemble(
        "thing",
        "thing",
        parts,
        density=density,
        friction=0.5,
        color=(1, 0, 0),
        source="procedural",
        rng=np.random.default_rng(0),
    )


def inside(hull: np.ndarray, points: np.ndarray, margin: float) -> np.ndarray:
    planes = ConvexHull(hull).equations
    return (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) < -margin


def test_volumes_are_those_of_the_formulas():
    assert ConvexHull(box(0.2, 0.1, 0.01, 0.06, x=0.3)).volume == pytest.approx(0.2 * 0.1 * 0.05)
    cone = ConvexHull(frustum(0.04, 0.02, 0.0, 0.1, sides=400)).volume
    assert cone == pytest.approx(np.pi * 0.1 / 3 * (0.04**2 + 0.04 * 0.02 + 0.02**2), rel=1e-3)
    wall = sum(ConvexHull(piece).volume for piece in shell([(0.05, 0.0), (0.05, 0.1)], 0.005, sides=400))
    assert wall == pytest.approx(np.pi * 0.1 * (0.05**2 - 0.045**2), rel=1e-3)
    assert ConvexHull(prism(circle_outline(0.03, 4), 0.0, 0.1)).volume == pytest.approx(2 * 0.03**2 * 0.1)


def test_the_frame_lies_under_the_centroid_of_the_footprint():
    model = solid(box(0.1, 0.1, 0.2, 0.25, x=0.4, y=-0.1), box(0.1, 0.02, 0.2, 0.21, x=0.5, y=-0.1))
    np.testing.assert_allclose(footprint_centroid(model.footprint), 0.0, atol=1e-9)
    assert np.concatenate(model.hulls)[:, 2].min() == 0.0
    assert model.height == pytest.approx(0.05)


def test_an_area_centroid_is_not_the_mean_of_the_corners():
    triangle = np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 0.3], [0.01, 0.0], [0.02, 0.0]])
    np.testing.assert_allclose(footprint_centroid(triangle), (0.1, 0.1))


def test_surface_points_are_uniform_on_the_outside_of_the_union():
    """Two boxes that overlap: nothing in the inner walls, as many points on a face as it has area."""
    hulls = [box(0.1, 0.1, 0.0, 0.1), box(0.1, 0.05, 0.0, 0.05, x=0.08)]
    points, normals = sample_surface(hulls, 6000, np.random.default_rng(0))
    for hull in hulls:
        assert not inside(hull, points, 1e-5).any()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    for hull in hulls:
        assert not inside(hull, points + 1e-3 * normals, 1e-4).any()
    cube, window = 6 * 0.1 * 0.1, 0.05 * 0.05
    sticking_out = 2 * 0.08 * 0.05 + 2 * 0.08 * 0.05 + 0.05 * 0.05  # top and bottom, sides, end
    top = (points[:, 2] > 0.0999).mean()
    assert top == pytest.approx(0.01 / (cube - window + sticking_out), rel=0.12)


def test_faces_wind_outward():
    model = solid(box(0.1, 0.06, 0.0, 0.04), frustum(0.02, 0.01, 0.04, 0.1))
    corners = model.mesh_vertices[model.mesh_faces]
    volume = (np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6
    assert volume == pytest.approx(sum(ConvexHull(hull).volume for hull in model.hulls))


def test_masses_are_volume_times_density_within_limits():
    assert solid(box(0.1, 0.1, 0, 0.1)).mass == pytest.approx(0.5)
    assert solid(box(0.01, 0.01, 0, 0.01)).mass == 0.02
    assert solid(box(0.2, 0.2, 0, 0.2)).mass == 1.5


def test_what_can_carry_is_measured_on_the_surface():
    assert solid(box(0.1, 0.1, 0, 0.05)).stackable
    assert solid(frustum(0.05, 0.05, 0, 0.005), *shell([(0.05, 0.0), (0.05, 0.08)], 0.004)).stackable  # by its rim
    cone = solid(frustum(0.05, 0.01, 0, 0.1))
    assert not cone.stackable and cone.flat_bottom
    upside_down = solid(frustum(0.01, 0.05, 0, 0.1))
    assert upside_down.stackable and not upside_down.flat_bottom


def test_every_kind_in_turn_and_the_same_objects_for_the_same_seed():
    objects = procedural_objects(2 * len(KINDS), seed=5)
    assert [model.category for model in objects] == 2 * list(KINDS)
    assert len({model.name for model in objects}) == len(objects)
    again = procedural_object("mug", 1, seed=5)
    found = next(model for model in objects if model.name == again.name)
    np.testing.assert_array_equal(found.surface_points, again.surface_points)
    assert found.mass == again.mass
    other = procedural_object("mug", 1, seed=6)
    assert other.name != again.name and other.height != again.height
    with pytest.raises(KeyError):
        procedural_object("sofa", 0)


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_have_household_sizes_and_connected_parts(kind):
    for index in range(4):
        model = procedural_object(kind, index, seed=11)
        assert 0.003 < model.height < 0.27 and 0.015 < model.radius < 0.25
        assert 0.02 <= model.mass <= 1.5 and 0.3 < model.friction < 0.9
        low, high = (np.array([getattr(hull, way)(axis=0) for hull in model.hulls]) for way in ("min", "max"))
        touching = ((low[:, None] <= high[None] + 1e-6) & (low[None] <= high[:, None] + 1e-6)).all(axis=-1)
        reached = np.linalg.matrix_power(touching.astype(float), len(model.hulls))[0] > 0
        assert reached.all(), model.name


def test_cutlery_points_along_x_with_its_broad_end():
    for kind in ("fork", "spoon"):
        for index in range(4):
            points = procedural_object(kind, index, seed=2).surface_points
            middle = 0.5 * (points[:, 0].min() + points[:, 0].max())
            front, back = points[points[:, 0] > middle], points[points[:, 0] < middle]
            assert np.std(front[:, 1]) > np.std(back[:, 1])
