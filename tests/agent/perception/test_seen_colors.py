"""Colours have the names that people give them, under any usual light; where people differ, two names are given."""

import numpy as np
import pytest

from agent.perception.seen_colors import color_names, light_of

LAMPS = {"daylight": (1, 1, 1), "dim": (0.2, 0.2, 0.2), "warm": (1.15, 1.0, 0.8), "cold": (0.88, 1.0, 1.15)}
THINGS = {  # sRGB as in catalogues of tableware and toys
    "red": (190, 30, 35), "green": (40, 130, 60), "blue": (40, 80, 170), "yellow": (240, 205, 50),
    "turquoise": (50, 170, 165), "purple": (110, 50, 140), "white": (240, 240, 236), "brown": (105, 65, 40),
}  # fmt: skip


def encoded(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, 0, 1)
    return np.rint(255 * np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)).astype("u1")


def photographed(color, lamp, rng, count=1500):
    """Pixels (P, 3) of a round object: half in shade, some in a highlight, all noisy."""
    share = np.asarray(color) / 255
    linear = np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)
    seen = linear * rng.uniform(0.25, 1.0, (count, 1))
    seen[: count // 40] += 0.6
    seen = seen * LAMPS[lamp]
    return encoded(seen + rng.normal(0, 1, seen.shape) * np.sqrt(0.0004 * seen + 2e-6))


@pytest.mark.parametrize("lamp", LAMPS)
def test_things_are_named_as_people_name_them(lamp):
    rng = np.random.default_rng(0)
    pixels = {name: photographed(color, lamp, rng) for name, color in THINGS.items()}
    light = light_of(np.vstack((*pixels.values(), photographed((190, 185, 178), lamp, rng, 9000))))
    named = {name: color_names(seen, light)[0].word for name, seen in pixels.items()}
    assert named == {name: name for name in THINGS}


def test_a_colour_between_two_names_has_both():
    rng = np.random.default_rng(0)
    light = light_of(photographed((235, 235, 235), "daylight", rng, 9000))
    names = color_names(photographed((40, 120, 140), "daylight", rng), light)  # petrol
    assert {each.word for each in names} == {"blue", "turquoise"}
    assert names[0].share >= names[1].share > 0.2


def test_letters_in_white_do_not_hide_the_colour():
    rng = np.random.default_rng(0)
    tin = np.vstack((photographed((180, 25, 30), "daylight", rng, 600), photographed((245,) * 3, "daylight", rng, 700)))
    light = light_of(np.vstack((tin, photographed((150, 120, 90), "daylight", rng, 9000))))
    assert color_names(tin, light)[0].word == "red"


def test_a_brown_tin_is_brown_in_every_frame():
    """As the exposure follows what else is in the picture, the same tin becomes lighter and darker."""
    rng = np.random.default_rng(0)
    for lamp in LAMPS:
        tin, table = photographed((110, 70, 45), lamp, rng), photographed((120, 118, 115), lamp, rng, 6000)
        light = light_of(np.vstack((tin, table, photographed((240, 240, 238), lamp, rng, 1500))))
        assert color_names(tin, light)[0].word == "brown", lamp


def test_white_in_bluish_shade_is_white_and_light_blue_is_blue():
    picture = np.full((9000, 3), (225, 205, 195), np.uint8)  # a pinkish table
    light = light_of(picture)
    cup, sky = (np.full((500, 3), color, np.uint8) for color in ((172, 176, 205), (135, 190, 235)))
    assert "white" in {each.word for each in color_names(cup, light)}
    assert color_names(sky, light)[0].word == "blue"
