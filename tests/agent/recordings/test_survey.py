"""Bags of very many topics are read in a few passes together, whatever their format, and nothing is read twice."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from agent.recordings.bag_reader import Bag, open_bag
from agent.recordings.inspection import inspect_bag
from agent.recordings.survey import first_times, last_times, look_at_first

TOPICS, ROUNDS, START, STEP = 200, 4, 1_700_000_000_000_000_000, 1_000_000
KINDS = ("sensor_msgs/msg/Image", "sensor_msgs/msg/JointState", "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo")
FORMATS = ("bag", "mcap", "db3")


def message(types, kind: str, ros1: bool):
    """Make a small message that is of no use to a run."""
    made = types.types
    header = made["std_msgs/msg/Header"](
        stamp=made["builtin_interfaces/msg/Time"](1, 0), frame_id="f", **({"seq": 0} if ros1 else {})
    )
    if kind.endswith("Image"):
        return made[kind](header, 2, 2, "16UC1", 0, 4, np.ones(8, np.uint8))
    if kind.endswith("JointState"):
        return made[kind](header, ["gripper"], np.zeros(1), np.zeros(1), np.zeros(1))
    if kind.endswith("TFMessage"):
        return made[kind]([])
    fields = {"K": np.eye(3).ravel(), "D": np.zeros(5), "R": np.eye(3).ravel(), "P": np.eye(3, 4).ravel()}
    fields = fields if ros1 else {name.lower(): value for name, value in fields.items()}
    roi = made["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    return made[kind](header, 2, 2, "plumb_bob", binning_x=0, binning_y=0, roi=roi, **fields)


def written(folder: Path, kind_of_file: str, times: dict[str, tuple[str, list[int]]]) -> Path:
    """Write a bag. `times`: topic -> its type and when its messages were recorded, steps after the start."""
    ros1 = kind_of_file == "bag"
    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    path = folder / ("many.bag" if ros1 else "many")
    storage = StoragePlugin.MCAP if kind_of_file == "mcap" else StoragePlugin.SQLITE3
    with Writer1(path) if ros1 else Writer2(path, version=9, storage_plugin=storage) as writer:
        there = {}
        for topic, (kind, _) in times.items():
            if ros1 and kind.startswith("tf2"):
                from rosbags.typesys import get_types_from_msg

                types.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", kind))
            there[topic] = writer.add_connection(topic, kind, typestore=types)
        rows = sorted((moment, topic) for topic, (_, moments) in times.items() for moment in moments)
        for moment, topic in rows:
            kind = times[topic][0]
            pack = types.serialize_ros1 if ros1 else types.serialize_cdr
            writer.write(there[topic], START + moment * STEP, pack(message(types, kind, ros1), kind))
    return path


@pytest.fixture
def reading(monkeypatch):
    """What is read: the number of passes, and how often each message was given."""
    passes, given = [], Counter()
    messages = Bag.messages

    def counted(self, streams, start=None, stop=None):
        passes.append(len(streams))
        for found in messages(self, streams, start, stop):
            given[(found.stream.topic, found.recorded)] += 1
            yield found

    monkeypatch.setattr(Bag, "messages", counted)
    return passes, given


@pytest.mark.parametrize("kind_of_file", FORMATS)
@pytest.mark.parametrize(
    "kinds", [KINDS, *((kind,) for kind in KINDS)], ids=lambda kinds: kinds[0][:11] + str(len(kinds))
)
def test_two_hundred_topics_take_a_few_passes(tmp_path, reading, kind_of_file, kinds):
    times = {
        f"/{number:03d}/{kinds[number % len(kinds)].rsplit('/', 1)[1].lower()}": (
            kinds[number % len(kinds)], [number + TOPICS * turn for turn in range(ROUNDS)]
        )
        for number in range(TOPICS)
    }  # fmt: skip
    info = inspect_bag(written(tmp_path, kind_of_file, times))
    passes, given = reading
    assert len(info.topics) == TOPICS and len(passes) < 60, len(passes)
    assert given.total() < 12 * TOPICS * ROUNDS
    for topic in info.topics:
        moments = times[topic.name][1]
        assert (topic.first, topic.last) == pytest.approx((moments[0] / 1000, moments[-1] / 1000), abs=1e-9)


@pytest.mark.parametrize("kind_of_file", FORMATS)
def test_rare_and_late_topics_are_found_and_no_message_is_given_twice(tmp_path, reading, kind_of_file):
    """Some speak once at the end, some all at the same moment, one all the time, and one often at that one moment."""
    kind = KINDS[1]
    times = {f"/late{number}": (kind, [5000 + number // 3]) for number in range(9)}
    times |= {f"/same{number}": (kind, [7, 9, 9000]) for number in range(9)}
    times |= {"/all": (kind, [*range(0, 9000, 10)]), "/burst": (kind, [7] * 40 + [8999])}
    path = written(tmp_path, kind_of_file, times)
    heard = Counter()

    def third(found) -> bool:
        heard[found.stream.topic] += 1
        return heard[found.stream.topic] >= 3

    with open_bag(path) as bag:
        look_at_first(bag, bag.streams, third)
        assert heard == {topic: min(3, len(moments)) for topic, (_, moments) in times.items()}
        heard.clear()
        look_at_first(
            bag, bag.streams, lambda found: heard.update([found.stream.topic]) or heard[found.stream.topic] > 30
        )
        assert heard == {topic: min(31, len(moments)) for topic, (_, moments) in times.items()}
        first = first_times(bag, bag.streams)
        last = last_times(bag, first)
    assert {stream.topic: (time - START) // STEP for stream, time in first.items()} == {
        topic: moments[0] for topic, (_, moments) in times.items()
    }
    assert {stream.topic: (time - START) // STEP for stream, time in last.items()} == {
        topic: moments[-1] for topic, (_, moments) in times.items()
    }


def test_a_large_topic_is_left_when_only_rare_ones_are_waited_for(tmp_path, reading, monkeypatch):
    monkeypatch.setattr("agent.recordings.survey._MOST_UNNEEDED", 1000)
    times = {"/all": (KINDS[0], [*range(0, 5000, 5)])}
    times |= {f"/late{number}": (KINDS[1], [5000]) for number in range(4)}
    with open_bag(written(tmp_path, "mcap", times)) as bag:
        assert len(first_times(bag, bag.streams)) == 5
    assert reading[1].total() < 100  # of the thousand pictures few are read
