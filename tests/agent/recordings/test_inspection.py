"""What a bag holds, for people and as JSON."""

import io
import json

import pytest

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag
from agent.recordings.inspection import inspect_bag, print_bag_info
from tests.agent.recordings.bag_making import (
    COLOR,
    DEPTH,
    DEPTH_INFO,
    JOINTS,
    OPTICAL,
    depth_image,
    depths,
    joints,
    session,
    transform,
    write_bag,
)


@pytest.mark.parametrize("name", ["session.bag", "session.mcap", "session.db3", "session"])
def test_a_whole_session_is_listed(tmp_path, name):
    info = inspect_bag(write_bag(tmp_path / name, [*session(), transform("root", "hand", seconds=0.2, topic="/tf")]))
    assert info.seconds == pytest.approx(0.3)
    of = {topic.name: topic for topic in info.topics}
    assert (of[DEPTH].count, of[DEPTH].role, of[DEPTH].frame) == (3, "depth", OPTICAL)
    assert (of[DEPTH].rate, of[DEPTH].first, of[DEPTH].last) == pytest.approx((10, 0.1, 0.3))
    assert of["/tf"].rate is None and of["/tf"].first == of["/tf"].last == pytest.approx(0.2)
    assert all(info.available.values()) and info.notes == ()
    assert (info.used["color"], info.used["joints"]) == (COLOR, JOINTS)
    output = json.loads(json.dumps(info.to_dict()))
    assert output["frames"][-1] == {"name": "root", "parent": "world", "static": True}
    assert [topic["name"] for topic in output["topics"]] == sorted(of)
    out = io.StringIO()
    print_bag_info(info, out)
    assert "world\n    camera_link\n      camera_color_optical_frame" in out.getvalue()
    assert "hand (moving)" in out.getvalue() and "camera to arm  yes" in out.getvalue()


def test_what_is_missing_is_reported(tmp_path):
    info = inspect_bag(write_bag(tmp_path / "bare.bag", [depth_image(depths())]))
    assert not any(info.available.values()) and info.used == {}
    assert any("no sensor_msgs/CameraInfo" in note for note in info.notes)
    out = io.StringIO()
    print_bag_info(info, out)
    assert "note: " in out.getvalue() and f"{DEPTH}  sensor_msgs/Image" in out.getvalue()


def test_named_topics_are_used(tmp_path):
    other = depth_image(depths(), 0.1, "/my/range")
    path = write_bag(tmp_path / "named.bag", [*session(), other])
    assert inspect_bag(path, {"depth": "/my/range", "depth_info": DEPTH_INFO}).used["depth"] == "/my/range"
    with pytest.raises(BadInput, match="has no topic '/other' of .* for depth; legal: .*/my/range"):
        inspect_bag(path, {"depth": "/other"})


def test_of_big_topics_little_is_read(tmp_path, monkeypatch):
    said = [message for k in range(100) for message in (depth_image(depths(), k), joints(k))]
    path = write_bag(tmp_path / "long.mcap", [*session(), *said[10:]])
    decoded, messages = [], Bag.decoded

    def counted(bag, message):
        decoded.append(message)
        return messages(bag, message)

    monkeypatch.setattr(Bag, "decoded", counted)
    info = inspect_bag(path)
    assert next(topic for topic in info.topics if topic.name == DEPTH).last == pytest.approx(99)
    assert len(decoded) < 40
