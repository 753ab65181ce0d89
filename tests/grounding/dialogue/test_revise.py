"""Corrections in conversation: what follows from the last wish and a sentence."""

import pytest

from grounding.dialogue.revise import REVISION_STATUSES, revise
from grounding.spec import SLOTS, StructureSpec

RING = StructureSpec("circle", "medium", "left", "top", "north")
ROW = StructureSpec("line", None, "center")
TOWER = StructureSpec("tower", None, None, "top")
SETTING = StructureSpec("table setting", None, "right", "bottom", "south")
NOTHING = StructureSpec()


def _changes(last, revision):
    assert revision.changed == tuple(s for s in SLOTS if getattr(last, s) != getattr(revision.spec, s))
    return {slot: getattr(revision.spec, slot) for slot in revision.changed}


@pytest.mark.parametrize(
    ("last", "text", "changes"),
    [
        # size
        (RING, "a bit bigger", {"size": "large"}),
        (RING, "one size step up", {"size": "large"}),
        (RING, "one size down please", {"size": "small"}),
        (RING, "Bigger!", {"size": "large"}),
        (RING, "smaller, please", {"size": "small"}),
        (RING, "much tighter", {"size": "small"}),
        (StructureSpec("line", "small"), "a little longer", {"size": "medium"}),
        (StructureSpec("line", "small"), "much longer", {"size": "large"}),
        (RING, "spread it out more", {"size": "large"}),
        (RING, "closer together", {"size": "small"}),
        (RING, "not so big", {"size": "small"}),
        (RING, "that's too small", {"size": "large"}),
        (RING, "it is a little too spread out", {"size": "small"}),
        (RING, "could you leave more space between them?", {"size": "large"}),
        (RING, "make the ring less tight", {"size": "large"}),
        (RING, "bigger, no, smaller", {"size": "small"}),
        (RING, "spread the cups out more", {"size": "large"}),
        (ROW, "wider", {"size": "large"}),
        (RING, "twice as big", {"size": "large"}),
        (RING, "half the size, please", {"size": "small"}),
        (NOTHING, "smaller", {"size": "small"}),
        # left and right
        (RING, "move it to the other side", {"x_position": "right"}),
        (RING, "put it on the opposite side", {"x_position": "right"}),
        (RING, "a bit to the right", {"x_position": "center"}),
        (RING, "further right", {"x_position": "center"}),
        (RING, "all the way to the right", {"x_position": "right"}),
        (SETTING, "more to the left", {"x_position": "center"}),
        (SETTING, "that's too far right", {"x_position": "center"}),
        (TOWER, "a touch to the left", {"x_position": "left"}),
        (SETTING, "closer to the center", {"x_position": "center"}),
        # depth
        (SETTING, "further back", {"y_position": "middle"}),
        (SETTING, "also further away", {"y_position": "middle"}),
        (SETTING, "much further back", {"y_position": "top"}),
        (RING, "closer to me", {"y_position": "middle"}),
        (RING, "a little nearer", {"y_position": "middle"}),
        (RING, "bring it closer", {"y_position": "middle"}),
        (ROW, "closer", {"y_position": "bottom"}),
        (ROW, "a bit further away from me", {"y_position": "top"}),
        (RING, "to the other end", {"y_position": "bottom"}),
        (RING, "in the opposite corner", {"x_position": "right", "y_position": "bottom"}),
        (RING, "not so far back", {"y_position": "middle"}),
        # rotation
        (RING, "turn it around", {"rotation": "south"}),
        (RING, "facing the other way", {"rotation": "south"}),
        (RING, "the other way round", {"rotation": "south"}),
        (RING, "rotate it by 90 degrees", {"rotation": "east"}),
        (RING, "a quarter turn clockwise", {"rotation": "east"}),
        (RING, "a quarter turn counterclockwise, please", {"rotation": "west"}),
        (RING, "turn it 180 degrees", {"rotation": "south"}),
        (SETTING, "rotate it anticlockwise by 90°", {"rotation": "east"}),
        (SETTING, "rotate it by 270 degrees clockwise", {"rotation": "east"}),
        # back to open
        (RING, "no rotation, please", {"rotation": None}),
        (RING, "forget the size", {"size": None}),
        (RING, "anywhere is fine", {"x_position": None, "y_position": None}),
        (RING, "I don't care where", {"x_position": None, "y_position": None}),
        (RING, "the size doesn't matter", {"size": None}),
        (RING, "any direction", {"rotation": None}),
        (RING, "not on the left", {"x_position": None}),
        (RING, "just leave the position open", {"x_position": None, "y_position": None}),
        # several at once
        (RING, "smaller and further right", {"size": "small", "x_position": "center"}),
        (RING, "turn it around and make it a bit bigger", {"rotation": "south", "size": "large"}),
        (RING, "closer to me, and forget the size", {"y_position": "middle", "size": None}),
        (RING, "the other side, and closer together", {"x_position": "right", "size": "small"}),
        # absolute parts, which the parser reads
        (RING, "now as a line", {"shape": "line"}),
        (ROW, "make it a circle instead", {"shape": "circle"}),
        (RING, "but on the right", {"x_position": "right"}),
        (RING, "and facing me", {"rotation": "south"}),
        (RING, "same thing but on the right", {"x_position": "right"}),
        (RING, "put it on the right", {"x_position": "right"}),
        (ROW, "bigger and on the left", {"size": "large", "x_position": "left"}),
        (RING, "put them in a row instead", {"shape": "line"}),
        (RING, "not on the left but on the right", {"x_position": "right"}),
        (TOWER, "make it a large circle", {"shape": "circle", "size": "large"}),
        (RING, "put everything on the right", {"x_position": "right"}),
        (RING, "make it a tower instead", {"shape": "tower", "size": None, "rotation": None}),
    ],
)  # fmt: skip
def test_corrections(parser, last, text, changes):
    revision = revise(last, text, parser)
    assert (revision.status, revision.kind, revision.objects_text) == ("ok", "edit", None)
    assert _changes(last, revision) == changes


@pytest.mark.parametrize(
    ("last", "text", "message"),
    [
        (StructureSpec("circle", "large"), "bigger", "already large, the largest size"),
        (StructureSpec("circle", "small"), "a bit tighter", "already small, the smallest size"),
        (RING, "more to the left", "already on the left"),
        (RING, "further back", "already at the back"),
        (SETTING, "closer to me", "already at the front"),
        (TOWER, "bigger", "a tower has no size"),
        (TOWER, "turn it around", "a tower has no rotation"),
        (TOWER, "higher!", "follows from the objects"),
        (SETTING, "make it smaller", "a table setting has no size"),
        (RING, "don't make it bigger", "size stays as it is"),
        (RING, "turn it by 360 degrees", "full turn changes nothing"),
        (RING, "but on the left", "already so"),
    ],
)
def test_what_changes_nothing_is_answered(parser, last, text, message):
    revision = revise(last, text, parser)
    assert (revision.status, revision.spec, revision.changed) == ("unchanged", last, ())
    assert message in revision.message


def test_part_of_a_correction_may_be_impossible(parser):
    revision = revise(TOWER, "smaller and more to the left", parser)
    assert revision.status == "ok"
    assert revision.spec == StructureSpec("tower", None, "left", "top")
    assert revision.message == "a tower has no size"


def test_a_tower_drops_what_it_cannot_carry_and_says_so(parser):
    revision = revise(RING, "now as a tower", parser)
    assert revision.spec == StructureSpec("tower", None, "left", "top")
    assert revision.message == "a tower has no size and no rotation: dropped"


@pytest.mark.parametrize(
    ("last", "text", "slot", "options"),
    [
        (TOWER, "move it to the other side", "x_position", ("left", "right")),
        (ROW, "to the other side", "x_position", ("left", "right")),
        (NOTHING, "the other side", "x_position", ("left", "right")),
        (ROW, "to the other end", "y_position", ("top", "bottom")),
        (ROW, "turn it around", "rotation", ("north", "east", "south", "west")),
        (RING, "rotate it by 45 degrees", "rotation", ("north", "east", "south", "west")),
        (RING, "move it somewhere else", "x_position", ("center", "right")),
        (RING, "turn it, please", "rotation", ("north", "east", "south", "west")),
        (RING, "rotate it", "rotation", ("north", "east", "south", "west")),
    ],
)
def test_questions(parser, last, text, slot, options):
    revision = revise(last, text, parser)
    assert (revision.status, revision.spec, revision.changed) == ("ask", last, ())
    assert (revision.question.slot, revision.question.options) == (slot, options)
    assert revision.message == revision.question.text
    assert all(option in revision.message for option in options)


@pytest.mark.parametrize(
    ("text", "objects", "how", "changes"),
    [
        ("same thing but with the bowls", "bowls", "replace", {}),
        ("use the cans instead", "cans", "replace", {}),
        ("the same with the forks, but smaller", "forks", "replace", {"size": "small"}),
        ("do it again with three cans", "three cans", "replace", {}),
        ("everything but the bowl, same thing", "everything but the bowl", "replace", {}),
        ("now the mugs", "mugs", "replace", {}),
        ("now a line with everything", "everything", "replace", {"shape": "line"}),
        ("use all the objects, on the right", "everything", "replace", {"x_position": "right"}),
        ("add the mug", "the mug", "add", {}),
        ("and the fork too", "the fork", "add", {}),
        ("without the plate", "the plate", "remove", {}),
        ("leave out the spoon, and a bit bigger", "the spoon", "remove", {"size": "large"}),
    ],
)
def test_the_objects_change(parser, text, objects, how, changes):
    revision = revise(RING, text, parser)
    assert (revision.status, revision.kind) == ("ok", "edit")
    assert (revision.objects_text, revision.objects_how) == (objects, how)
    assert _changes(RING, revision) == changes


def test_once_more(parser):
    revision = revise(RING, "same again", parser)
    assert (revision.status, revision.spec, revision.objects_text) == ("ok", RING, None)


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        ("stack the cans at the back", StructureSpec("tower", None, None, "top")),
        ("put the cups in a small circle on the right", StructureSpec("circle", "small", "right")),
        ("set the table", StructureSpec("table setting")),
        ("build a tower on the left", StructureSpec("tower", None, "left")),
        ("line up the forks", StructureSpec("line")),
    ],
)
def test_a_whole_instruction_replaces_everything(parser, text, spec):
    revision = revise(RING, text, parser)
    assert (revision.status, revision.kind, revision.spec) == ("ok", "new", spec)
    assert (revision.objects_text, revision.objects_how) == (text, "replace")
    _changes(RING, revision)


@pytest.mark.parametrize(
    ("text", "viewpoint", "y_position"),
    [
        ("closer to you", "robot", "middle"),
        ("closer to the robot", "opposite", "top"),
        ("closer to me", "opposite", "middle"),
        ("put it near you", "robot", "bottom"),
        ("put it close to me", "opposite", "bottom"),
    ],
)
def test_the_robot_sits_across_from_some_speakers(parser, text, viewpoint, y_position):
    assert revise(RING, text, parser, viewpoint).spec.y_position == y_position


@pytest.mark.parametrize(
    "text", ["what time is it?", "", "🤖", "put the cups in a square", "make it a triangle instead"]
)
def test_refusals_leave_the_last_wish(parser, text):
    revision = revise(RING, text, parser)
    assert (revision.status, revision.spec, revision.changed) == ("refused", RING, ())
    assert revision.message


def test_thanks_do_not_hinder_a_correction(parser):
    revision = revise(RING, "thanks, that's lovely! just a bit smaller, please", parser)
    assert revision.spec == StructureSpec("circle", "small", "left", "top", "north")


@pytest.mark.parametrize(
    "text",
    [
        "bigger " * 3000,
        "turn " * 70,
        "not " * 90,
        "\x00\x1b[31m bigger",
        "{}%s",
        "the other side " * 20,
        "ً" * 300,
    ],
)
def test_any_string_is_answered(parser, text):
    revision = revise(ROW, text, parser)
    assert revision.status in REVISION_STATUSES
    assert revision.message or revision.status == "ok"


# Nothing but the shape was asked for; what was proposed lies on the left, small, and faces somewhere.
OPEN_LINE, OPEN_RING = StructureSpec("line"), StructureSpec("circle")
SHOWN_LINE = StructureSpec("line", "small", "left", "middle", "north")
SHOWN_RING = StructureSpec("circle", "large", "right", "top")
SHOWN_SETTING = StructureSpec("table setting", None, "center", "bottom", "south")


@pytest.mark.parametrize(
    ("last", "shown", "text", "changes", "words"),
    [
        (OPEN_LINE, SHOWN_LINE, "rotate it 90 degrees", {"rotation": "east"}, "faced north"),
        (OPEN_LINE, SHOWN_LINE, "turn it clockwise", {"rotation": "east"}, "no rotation was asked for"),
        (OPEN_LINE, SHOWN_LINE, "a quarter turn to the left", {"rotation": "west"}, "anticlockwise"),
        (OPEN_LINE, SHOWN_LINE, "rotate it by 270 degrees", {"rotation": "west"}, "faced north"),
        (StructureSpec("table setting"), SHOWN_SETTING, "turn it around", {"rotation": "north"}, "half a turn"),
        (StructureSpec("table setting"), SHOWN_SETTING, "turn it clockwise", {"rotation": "west"}, "faced south"),
        (OPEN_LINE, SHOWN_LINE, "bigger", {"size": "medium"}, "no size was asked for, and the proposal was small"),
        (OPEN_LINE, SHOWN_LINE, "a bit bigger", {"size": "medium"}, "small"),
        (OPEN_LINE, SHOWN_LINE, "much bigger", {"size": "large"}, "small"),
        (OPEN_RING, SHOWN_RING, "smaller", {"size": "medium"}, "large"),
        (OPEN_LINE, SHOWN_LINE, "further right", {"x_position": "center"}, "on the left"),
        (OPEN_RING, SHOWN_RING, "further left", {"x_position": "center"}, "on the right"),
        (OPEN_RING, SHOWN_RING, "closer to me", {"y_position": "middle"}, "at the back"),
        (OPEN_RING, SHOWN_RING, "the other side", {"x_position": "left"}, "on the right"),
        (StructureSpec("line", "large"), SHOWN_LINE, "smaller", {"size": "medium"}, ""),
    ],
)
def test_what_nobody_asked_for_changes_from_what_was_shown(parser, last, shown, text, changes, words):
    revision = revise(last, text, parser, stands=shown)
    assert (revision.status, _changes(last, revision)) == ("ok", changes)
    assert words in revision.message and bool(words) == bool(revision.message)


@pytest.mark.parametrize(
    ("last", "shown", "text", "status", "message"),
    [
        (OPEN_LINE, SHOWN_LINE, "turn it around", "unchanged", "a line looks the same after half a turn"),
        (OPEN_LINE, SHOWN_LINE, "smaller", "unchanged", "already small"),
        (OPEN_LINE, SHOWN_LINE, "further left", "unchanged", "already on the left"),
        (OPEN_LINE, SHOWN_LINE, "not on the left", "ask", "center or right"),
        (OPEN_LINE, SHOWN_LINE, "turn it by 45 degrees", "ask", "quarters only"),
        (OPEN_RING, SHOWN_RING, "turn it clockwise", "ask", "a full ring looks the same when it is turned"),
        (TOWER, StructureSpec("tower", None, "left", "top"), "turn it", "unchanged", "has no rotation"),
    ],
)
def test_what_was_shown_may_leave_nothing_to_change(parser, last, shown, text, status, message):
    revision = revise(last, text, parser, stands=shown)
    assert (revision.status, revision.spec) == (status, last)
    assert message in revision.message


def test_what_is_at_an_end_stays_there_where_something_else_changes(parser):
    revision = revise(OPEN_LINE, "smaller, and on the right", parser, stands=SHOWN_LINE)
    assert revision.spec == StructureSpec("line", "small", "right")
    assert "already small" in revision.message


def test_what_was_shown_of_another_shape_says_nothing_of_size_and_heading(parser):
    revision = revise(OPEN_RING, "make it a line, bigger and further left", parser, stands=SHOWN_RING)
    assert revision.spec == StructureSpec("line", "large", "center")


@pytest.mark.parametrize(
    ("text", "comes", "goes", "how"),
    [
        ("replace the mug with the bowl", "the bowl", "the mug", "exchange"),
        ("substitute the bowl for the mug", "the bowl", "the mug", "exchange"),
        ("use the bowl instead of the mug", "the bowl", "the mug", "exchange"),
        ("swap the cups for the mugs", "mugs", "cups", "exchange"),
        ("replace the cups with three cans", "three cans", "cups", "exchange"),
        ("the can rather than the cups", "the can", "cups", "exchange"),
        ("drop the mug and add the bowl", "the bowl", "the mug", "exchange"),
        ("swap the mug with the bowl", "the bowl", "the mug", "swap"),
    ],
)
def test_objects_are_exchanged_for_others(parser, text, comes, goes, how):
    revision = revise(RING, text, parser)
    assert (revision.status, revision.spec) == ("ok", RING)
    assert (revision.objects_text, revision.objects_out_text, revision.objects_how) == (comes, goes, how)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("bigger and purple", "'purple'"),
        ("smaller, 5 cm to the left", "'5 cm'"),
        ("smaller and paint it blue", "'paint it blue'"),
        ("the other side and sort them by height", "'sort them by height'"),
        ("further right and add a flag", "'add a flag'"),
        ("a bit smaller and shiny", "'shiny'"),
        ("make it bigger and tilted", "'tilted'"),
        ("further back, tallest on the left", "'tallest on the left'"),
    ],
)
def test_what_of_a_correction_is_not_understood_is_said(parser, text, words):
    revision = revise(RING, text, parser)
    assert (revision.status, revision.spec) == ("refused", RING)
    assert words in revision.message


_BEFORE = (
    "", "thanks, ", "hmm, nice, but ", "my mother is coming over, so ", "could you please ", "ok robot, ", "wait, ",
    "that's almost what I wanted. ", "you know what, ", "well done. ", "the camera cannot see it: ",
)  # fmt: skip
_AFTER = (
    "", " please", ", thank you", " for me", " if possible", ", that would be great", " because the cat sleeps there",
    ", would you?", " so that my son can reach it", ", cheers", " and that's it",
)  # fmt: skip


def test_what_is_said_besides_hinders_no_correction(parser):
    """At most 1 % of chatty corrections are refused for what is said besides."""
    plain = ("smaller", "move it to the other side", "a bit to the right", "closer to me", "turn it around")
    plain += ("now as a line", "add the mug", "forget the size", "spread it out more", "bring it closer", "not so big")
    said = [before + text + after for text in plain for before in _BEFORE for after in _AFTER]
    refused = [text for text in said if "not understood" in revise(RING, text, parser).message]
    assert len(refused) <= 0.01 * len(said), refused
