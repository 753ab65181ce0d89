"""Names of objects are compared without spaces, hyphens, underscores and capitals, by whole words."""

import pytest

from grounding.resolve.object_names import as_named


@pytest.mark.parametrize(
    ("text", "names", "spelled"),
    [
        ("put the gear box on the left", ["gearbox"], "put the gearbox on the left"),
        ("two gear boxes, a Gear-Box and a gear_box", ["gearBox"], "two gearboxes, a gearbox and a gearbox"),
        ("the coffeepot and the coffee-pots", ["coffee pot"], "the coffee pot and the coffee pots"),
        ("stack the soupcans", ["005_tomato_soup_can"], "stack the soup cans"),
        ("the gear box", ["gearbox", "Gear_Box 2"], "the gearbox"),
        ("the Gearbox and the Coffee Pot", ["gearbox", "coffee pot"], "the Gearbox and the Coffee Pot"),
        ("gear. box and gear, box", ["gearbox"], "gear. box and gear, box"),
        ("gear boxing in the ungear box", ["gearbox"], "gear boxing in the ungear box"),
        ("a corn cob is so upright", ["acorn", "soup can"], "a corn cob is so upright"),
        ("cups in a row", ["cup", "cup or mug 2", "object 3, red", "", None], "cups in a row"),
    ],
)
def test_a_text_is_spelled_as_objects_are_named(text, names, spelled):
    assert as_named(text, names) == spelled
    assert as_named(spelled, names) == spelled
