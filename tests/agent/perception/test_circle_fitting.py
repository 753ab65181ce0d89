"""Circles through places, also where only an arc was seen."""

import numpy as np
import pytest

from agent.perception.circle_fitting import circle_through


@pytest.mark.parametrize("seen", [2 * np.pi, 1.2])
def test_a_circle_is_found_from_an_arc_of_it(seen):
    angle = np.linspace(0.3, 0.3 + seen, 40)
    places = np.array([0.6, -0.2]) + 0.05 * np.column_stack((np.cos(angle), np.sin(angle)))
    middle, radius = circle_through(places)
    np.testing.assert_allclose(middle, (0.6, -0.2), atol=1e-6)
    assert radius == pytest.approx(0.05, abs=1e-6)


def test_a_line_has_no_circle():
    assert circle_through(np.column_stack((np.linspace(0.0, 0.1, 20), np.zeros(20))))[1] == 0.0
