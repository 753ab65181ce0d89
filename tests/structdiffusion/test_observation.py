"""Scenes as nouns: which objects take part, and the scene as if everything stood on the table."""

import numpy as np

from structdiffusion.observation import ObjectCloud, Scene


def cube(name: str, x: float, bottom: float = 0.0) -> ObjectCloud:
    points = np.random.default_rng(0).uniform((-0.03, -0.03, 0.0), (0.03, 0.03, 0.06), (50, 3)) + (x, 0.0, bottom)
    return ObjectCloud(name, "cube", points.astype(np.float32), bottom=bottom)


def test_what_stands_on_something_is_lowered_to_the_table():
    below, above, other = cube("a", 0.3), cube("b", 0.3, 0.06), cube("c", 0.5, 0.12)
    picture = np.zeros((4, 4, 3), np.uint8)
    flat = Scene((below, above), distractors=(other,), color=picture).on_the_table()
    assert flat.objects[0] is below and flat.color is picture
    for was, now in ((above, flat.objects[1]), (other, flat.distractors[0])):
        assert now.bottom == 0.0 and now.points.dtype == np.float32 and now.name == was.name
        np.testing.assert_allclose(was.points - now.points, np.tile((0.0, 0.0, was.bottom), (50, 1)), atol=1e-6)
    assert above.bottom == 0.06 and above.points[:, 2].min() > 0.05  # the scene itself stays as it was seen


def test_those_that_are_not_selected_become_distractors():
    a, b, c, d = (cube(name, 0.2 + 0.1 * i) for i, name in enumerate("abcd"))
    scene = Scene((a, b, c), distractors=(d,)).select([2, 0])
    assert [cloud.name for cloud in scene.objects] == ["c", "a"]
    assert [cloud.name for cloud in scene.distractors] == ["d", "b"]
