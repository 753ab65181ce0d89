"""What validation has and training has not: things that rock, roll and go into one another, at rest as they lie."""

import inspect
import sys
from collections import Counter
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between
from structdiffusion.objects import libraries, procedural
from structdiffusion.objects.everyday import everyday_objects
from structdiffusion.objects.libraries import training_objects, validation_objects
from structdiffusion.simulation.world import TabletopWorld


@pytest.fixture(scope="module")
def everyday():
    return everyday_objects()


def test_the_same_seed_gives_the_same_objects(everyday):
    again, other = everyday_objects(), everyday_objects(seed=1)
    for one, same, different in zip(everyday, again, other, strict=True):
        assert one.name == same.name != different.name
        np.testing.assert_array_equal(one.surface_points, same.surface_points)
    assert not np.array_equal(everyday[0].surface_points, other[0].surface_points)


def test_sizes_are_those_of_things_on_a_table(everyday):
    for model in everyday:
        assert 0.01 < model.height < 0.12 and 0.007 < model.radius < 0.09, model.name
        assert 0.02 <= model.mass <= 0.3, model.name


def test_they_lie_still_where_they_are_put(everyday):
    """A ball may roll a little over its flat; nothing tips over."""
    for model in everyday[::3]:
        pose = pose_from_xyz_yaw(0.45, 0.0, 0.0005, 0.3)
        with TabletopWorld([model], [pose]) as world:
            world.settle(1.0)
            assert tilt_between(world.pose(0), pose) < 0.35, model.name


def test_round_things_carry_nothing_and_cups_go_into_one_another(everyday):
    by = {}
    for model in everyday:
        by.setdefault(model.name.rsplit("_", 2)[0], []).append(model)
    assert not any(model.stackable for kind in ("ball", "apple", "pear", "lemon") for model in by[kind])
    assert all(model.stackable for kind in ("beaker", "foam_brick", "studded_brick", "die") for model in by[kind])
    assert sum(model.flat_bottom for kind in ("apple", "pear") for model in by[kind]) >= 3  # these may top a tower
    widths = sorted(model.radius for model in by["beaker"])
    assert widths[-1] > 1.5 * widths[0]


def test_they_are_for_validation_alone(everyday, monkeypatch):
    # PyBullet's objects, which take long to load, are named by the number of their folder: 20 of the 200 show it.
    monkeypatch.setattr(libraries, "random_urdfs_objects", partial(libraries.random_urdfs_objects, 20))
    # Only the names of the others count, and not their bodies, which take long to make; nothing of it may be kept.
    monkeypatch.setattr(procedural, "procedural_object", inspect.unwrap(procedural.procedural_object))
    for module in (procedural, sys.modules[everyday_objects.__module__]):
        monkeypatch.setattr(module, "made", lambda name, *_: SimpleNamespace(name=name))
    names = Counter(model.name for model in validation_objects())
    assert all(names[model.name] == 1 for model in everyday) and max(names.values()) == 1
    assert not names.keys() & {model.name for model in training_objects()}
