"""Nouns from a picture choose objects only where it is said, and only where no other object may be meant."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from agent import events
from agent.chat.table_facts import object_facts
from agent.errors import UsageError
from agent.perception import perceive
from agent.perception.segments import Segment
from agent.pipeline.run import RunOptions, run_instruction
from agent.recordings.recording import RecordedOptions
from agent.runtime.output_ownership import OwnFolder, check_own_folder
from agent.scenes.record_bag import record_session
from agent.scenes.recorded_nouns import doubts, how_to_name, taken_nouns
from agent.scenes.table_scene import TableScene
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import assemble, box


def segment(number: int, noun: str = "", **nouns: float) -> Segment:
    name = f"object {number}"
    display_name = f"{noun or 'object'} {number}"
    return Segment(name, display_name, np.zeros((1, 3)), None, np.eye(4), np.ones(3), noun=noun, nouns=nouns)


FOUND = (
    segment(1, "mug", mug=0.93, cup=0.95), segment(2, "bowl", bowl=0.9), segment(3, mug=0.41, cup=0.6), segment(4),
)  # fmt: skip


def test_what_is_taken_for_what_is_said_unless_the_user_said_it():
    assert taken_nouns(FOUND, {}) == ["object 1 is taken for a mug (0.93)", "object 2 is taken for a bowl (0.90)"]
    assert taken_nouns(FOUND, {"object 1": "can"}) == ["object 2 is taken for a bowl (0.90)"]


@pytest.mark.parametrize(
    ("noun", "chosen", "called", "unsure"),
    [
        ("mug", (0,), {}, {"object 3": "object 3 may be a mug too (0.41)"}),
        ("red mug", (0,), {}, {"object 3": "object 3 may be a mug too (0.41)"}),
        ("mug", (0,), {"object 3": "vase"}, {}),  # the user's word goes before the picture's
        ("mug", (0, 2), {"object 3": "mug"}, {}),
        ("bowl", (1,), {}, {}),
        (
            "cup",
            (),
            {},
            {f"object {k}": f"object {k} may be a cup too ({share})" for k, share in ((1, "0.95"), (3, "0.60"))},
        ),
    ],
)
def test_objects_that_may_be_meant_too_are_asked_about(noun, chosen, called, unsure):
    assert doubts(FOUND, called, (noun,), chosen, lambda *_: True) == unsure
    assert doubts(FOUND, called, (noun,), chosen, lambda *_: False) == {}


def test_what_may_have_been_left_out_is_asked_about():
    unsure = doubts((FOUND[1], FOUND[2]), {}, ("mug",), (0,), lambda *_: True)
    assert unsure == {"object 3": "object 3 may be a mug too (0.41)"}


def test_an_object_that_is_one_of_two_is_said_and_meant_by_both_words():
    found = (segment(1, "cup or mug", cup=0.5, mug=0.38), segment(2, "cup", cup=0.9), segment(3, "bowl", bowl=0.8))
    assert taken_nouns(found[:1], {}) == ["object 1 is taken for a cup or mug (0.88)"]
    names = [each.display_name for each in found]
    assert resolve_phrase("the mug", Referents(names)).indices == (0,)
    assert resolve_phrase("the cups", Referents(names)).indices == (0, 1)


def test_the_question_shows_the_picture_and_the_guesses():
    question = how_to_name(FOUND, "object 3", np.full((4, 6, 3), 80, np.uint8))
    assert "object 3 may be a mug (0.41)" in question
    assert question.endswith("--call 'object 3=cup' says what an object is")
    path = question.split("numbered in ")[1].split(";")[0]
    assert Image.open(path).size == (6, 4)


def test_the_picture_is_in_the_output_folder_of_the_command(tmp_path):
    folder = tmp_path / "out"
    question = how_to_name(FOUND, "object 3", np.full((4, 6, 3), 80, np.uint8), OwnFolder(folder, "run"))
    assert f"numbered in {folder / 'objects.png'};" in question and Image.open(folder / "objects.png").size == (6, 4)
    check_own_folder(folder, "run")  # the command may be repeated
    with pytest.raises(UsageError):
        check_own_folder(folder, "chat")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Three blocks; what they are taken for is said by the tests."""
    rng = np.random.default_rng(0)
    cube = [box(0.05, 0.05, 0.0, 0.05)]
    models = [
        assemble(f"block {k}", "block", cube, density=400, friction=0.6, color=(0.8, 0.2, 0.2), source="test", rng=rng)
        for k in range(3)
    ]
    poses = np.array([pose_from_xyz_yaw(0.4, y, 0.0, 0.0) for y in (0.2, 0.0, -0.2)])
    path = tmp_path_factory.mktemp("recorded") / "three.bag"
    with TableScene(models, poses, 3, rng) as table:
        record_session(table, path, rng)
    return path


@pytest.fixture
def taking(monkeypatch):
    """Makes perception take the objects for something."""

    def takes(*nouns: dict[str, float]) -> None:
        def named(recording, segments):
            found = []
            for each, own in zip(segments.objects, nouns, strict=True):
                noun = next((noun for noun, share in own.items() if share >= 0.8), "")
                words = each.display_name.replace("object", noun, 1) if noun else each.display_name
                found.append(replace(each, noun=noun, nouns=own, display_name=words))
            return replace(segments, objects=tuple(found))

        monkeypatch.setattr(perceive, "with_nouns", named)

    return takes


def run(words: str, bag, **nouns: str):
    recorded = RecordedOptions(nouns={name.replace("_", " "): noun for name, noun in nouns.items()})
    return list(run_instruction(words, RunOptions(str(bag), model="geometric", execute=False, recorded=recorded)))


def test_mugs_that_were_named_are_put_in_a_line_and_it_is_said(bag, taking):
    taking({"mug": 0.93}, {"mug": 0.91}, {"bowl": 0.9})
    happened = run("put the mugs in a line", bag)
    (seen,) = (event for event in happened if isinstance(event, events.Perceived))
    assert {one.display_name.split(",")[0] for one in seen.objects if one.takes_part} == {"mug 1", "mug 2"}
    assert [(one.name, one.category, one.confidence) for one in seen.objects][0] == ("object 1", "mug", 0.93)
    assert seen.notes[:2] == ("object 1 is taken for a mug (0.93)", "object 2 is taken for a mug (0.91)")
    assert [fact.label for fact in object_facts(seen)][:2] == ["object 1 (mug, 0.93)", "object 2 (mug, 0.91)"]
    assert not any("taken for" in note for note in perceived(run("put everything in a line", bag)).notes)


def perceived(happened):
    return next(event for event in happened if isinstance(event, events.Perceived))


def test_mugs_in_doubt_are_asked_about(bag, taking):
    taking({"mug": 0.93}, {"mug": 0.91}, {"mug": 0.41})
    *_, failed, ended = run("put the mugs in a line", bag)
    assert ended.exit_code == 3 and "object 3 may be a mug too (0.41)" in failed.message
    assert "the objects are numbered in " in failed.message
    seen = perceived(run("put the mugs in a line", bag, object_3="mug"))
    assert sum(one.takes_part for one in seen.objects) == 3


@pytest.mark.parametrize(
    ("words", "moved", "reference"),
    [
        ("put mug 1 in front of object 3", "object 1", "object 3"),  # its number says which one
        ("put object 3 in front of mug 1", "object 3", "object 1"),
        ("put the left mug in front of object 3", "object 1", "object 3"),  # the other one stands on the right
    ],
)
def test_what_an_instruction_tells_without_the_doubtful_noun_is_not_asked_about(bag, taking, words, moved, reference):
    taking({"mug": 0.93}, {"mug": 0.41}, {"bowl": 0.6})
    happened = run(words, bag)
    assert happened[-1].exit_code == 0
    (parsed,) = (event for event in happened if isinstance(event, events.Parsed))
    (part,) = parsed.goal["parts"]
    assert [parsed.objects[index] for index in (*part["objects"], *part["reference"])] == [moved, reference]
    *_, failed, ended = run("put the mug in front of object 3", bag)
    assert ended.exit_code == 3 and "object 2 may be a mug too (0.41)" in failed.message
    assert "object 3" not in failed.message and failed.message.endswith("--call 'object 2=cup' says what an object is")


def test_what_the_user_calls_an_object_goes_before_the_picture(bag, taking):
    taking({"mug": 0.93}, {"mug": 0.91}, {"mug": 0.95})
    seen = perceived(run("put the mugs in a line", bag, object_3="bowl"))
    assert {one.name for one in seen.objects if one.takes_part} == {"object 1", "object 2"}
    assert not any("object 3" in note or "bowl 3" in note for note in seen.notes)
