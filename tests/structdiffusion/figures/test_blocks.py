"""Objects of any widths stand along a wall so that each lies on what carries it in the drawing, or not at all."""

import numpy as np
import pytest

from grounding.figures.growth import supports_of
from grounding.figures.names import figure_named, shipped_names
from structdiffusion.figures.blocks import CLEAR, HOLD, places_along


@pytest.mark.parametrize("name", [name for name in shipped_names() if figure_named(name).stacked])
def test_supports_are_those_of_the_drawing(name):
    figure, rng = figure_named(name), np.random.default_rng(1)
    for count in figure.legal[:2]:
        blocks = figure.blocks_of(count)[0]
        widths = np.array([0.11 if block.width > 1 else 0.04 for block in blocks]) * rng.uniform(0.97, 1.03, count)
        middles = places_along(blocks, widths)
        assert middles is not None
        reach = (widths[:, None] + widths) / 2 - np.abs(middles[:, None] - middles)
        for k, own in enumerate(supports_of(blocks)):
            below = [j for j in range(count) if blocks[j].level == blocks[k].level - 1 and reach[k, j] > 0]
            assert sorted(below) == sorted(own)
            if len(own) > 1:
                assert all(reach[k, j] >= HOLD * min(widths[k], widths[j]) - 1e-9 for j in own)
        for i in range(count):
            for j in range(i):
                if blocks[i].level == blocks[j].level:
                    assert reach[i, j] <= -CLEAR + 1e-9


def test_an_opening_is_wide_for_a_long_lintel():
    (blocks,) = figure_named("gate").blocks_of(3)
    openings = [float(np.ptp(places_along(blocks, (0.04, 0.04, length))[:2])) for length in (0.06, 0.12)]
    assert openings[1] > openings[0] + 0.02


def test_what_is_too_short_to_bridge_has_no_place():
    assert places_along(figure_named("gate").blocks_of(3)[0], (0.08, 0.08, 0.006)) is None
