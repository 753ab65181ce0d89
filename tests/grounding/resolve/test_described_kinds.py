"""Kinds of objects that are described by their use."""

import pytest

from grounding.resolve.described_kinds import described_kind

KINDS = {
    "toys": ("ball", "car", "block", "duck"),
    "workshop": ("hammer", "drill", "screwdriver", "clamp", "box"),
    "kitchen": ("kettle", "pan", "teapot", "pitcher", "sponge", "egg"),
    "office": ("stapler", "mug", "pen", "notebook", "phone"),
}


@pytest.mark.parametrize(
    ("text", "scene", "kind"),
    [
        ("the thing that quacks", "toys", "duck"),
        ("the only one with wheels", "toys", None),  # by exclusion
        ("the two that turn screws", "workshop", None),  # no word for an object
        ("whatever can turn a screw by hand", "workshop", "screwdriver"),
        ("the thing for nails", "workshop", "hammer"),
        ("what hens lay", "kitchen", "egg"),
        ("the thing for boiling water", "kitchen", "kettle"),
        ("the ringing thing", "office", "phone"),
        ("things with ink", "office", "pen"),
    ],
)
def test_a_use_means_a_kind(encoder, text, scene, kind):
    assert described_kind(text, KINDS[scene], encoder) == kind


@pytest.mark.parametrize(
    "text",
    [
        "the yellow thing",  # a colour
        "the thing on the left",  # a place
        "the other thing",
        "the thing that is not a duck",
        "the biggest thing",
        "everything",
        "that sour duck",  # a noun that is there
        "the thing",
    ],
)
def test_colours_places_and_exclusions_describe_no_use(encoder, text):
    assert described_kind(text, KINDS["toys"], encoder) is None


def test_one_kind_is_no_choice(encoder):
    assert described_kind("the thing that quacks", ("duck",), encoder) is None
