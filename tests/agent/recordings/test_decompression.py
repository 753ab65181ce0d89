"""Packed bags: read as they are, and refused where a few bytes stand for far more."""

import os
import subprocess
import sys
from pathlib import Path

import apsw
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from agent.errors import BadInput
from agent.recordings.bag_reader import open_bag
from agent.recordings.decompression import UnpackingLimits
from agent.recordings.load import read_recording
from tests.agent.recordings.bag_making import session, write_bag

ROOT = Path(__file__).parents[3]
WAYS = ("bz2", "lz4", "mcap", "file", "message")
SMALL = UnpackingLimits(piece=50_000, all_pieces=200_000, all_times=2, files=100_000, file_times=2)
LONG = 1_000_000  # bytes of a message of nothing, which packs to a thousandth


def packed(folder: Path, way: str, messages: int = 1, length: int = LONG) -> Path:
    """A bag of empty pictures, packed in one of the `WAYS`."""
    path = folder / ("bag.bag" if way in ("bz2", "lz4") else "bag")
    types = get_typestore(Stores.ROS1_NOETIC if path.suffix else Stores.ROS2_HUMBLE)
    if path.suffix:
        writer = Writer1(path)
        writer.set_compression(Writer1.CompressionFormat[way.upper()])
    else:
        plugin = StoragePlugin.MCAP if way == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=8, storage_plugin=plugin)
        modes = {"mcap": CompressionMode.STORAGE, "file": CompressionMode.FILE, "message": CompressionMode.MESSAGE}
        writer.set_compression(modes[way], CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/a", "std_msgs/msg/String", typestore=types)
        for number in range(messages):
            writer.write(connection, 10**9 * (number + 1), bytes(length))
    return path


def lengths(path: Path, limits: UnpackingLimits) -> list[int]:
    with open_bag(path, limits) as bag:
        return [len(message.raw) for message in bag.messages(bag.streams)]


@pytest.mark.parametrize("way", WAYS)
def test_a_packed_bag_is_read(tmp_path, way):
    assert lengths(packed(tmp_path, way, 2), UnpackingLimits()) == [LONG] * 2
    (tmp_path / "small").mkdir()
    assert lengths(packed(tmp_path / "small", way, 3, 1000), SMALL) == [1000] * 3


@pytest.mark.parametrize("way", WAYS)
def test_a_piece_that_becomes_too_large_is_refused(tmp_path, way):
    path = packed(tmp_path, way)
    with pytest.raises(BadInput, match="becomes larger than 50000 bytes|temporary files of 100000 bytes") as caught:
        lengths(path, SMALL)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("way", ["bz2", "message"])
def test_pieces_that_become_too_large_together_are_refused(tmp_path, way):
    limits = UnpackingLimits(piece=3 * LONG, all_pieces=3 * LONG, all_times=1)
    path = packed(tmp_path, way, 5)
    (tmp_path / "few").mkdir()
    assert lengths(packed(tmp_path / "few", way, 2), limits) == [LONG] * 2
    with pytest.raises(BadInput, match="all that is read of this bag"):
        lengths(path, limits)


def test_a_piece_counts_as_often_as_it_is_unpacked(tmp_path):
    limits = UnpackingLimits(piece=2 * LONG, all_pieces=3 * LONG, all_times=1)
    with open_bag(packed(tmp_path, "message", 2), limits) as bag:
        assert len(list(bag.messages(bag.streams))) == 2
        with pytest.raises(BadInput, match="all that is read of this bag"):
            list(bag.messages(bag.streams))


def test_no_temporary_file_is_left_of_a_folder_that_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    path = packed(tmp_path, "file")
    with pytest.raises(BadInput, match="temporary files"):
        lengths(path, SMALL)
    assert list((tmp_path / "temporary").iterdir()) == []


def test_a_damaged_piece_is_reported(tmp_path):
    path = packed(tmp_path, "bz2")
    content = path.read_bytes()
    at = content.index(b"BZh9")
    path.write_bytes(content[: at + 20] + bytes(8) + content[at + 28 :])
    with pytest.raises(BadInput, match="cannot read on in"):
        lengths(path, UnpackingLimits())


def test_a_database_that_makes_up_its_messages_is_refused(tmp_path):
    path = write_bag(tmp_path / "bag.db3", session([0.1]))
    with apsw.Connection(str(path)) as database:
        database.execute(
            "ALTER TABLE messages RENAME TO kept; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, "
            "timestamp INTEGER, data BLOB GENERATED ALWAYS AS (zeroblob(5000000)));"
            "INSERT INTO messages(id, topic_id, timestamp) SELECT id, topic_id, timestamp FROM kept"
        )
    with pytest.raises(BadInput, match="too big"):
        lengths(path, UnpackingLimits(piece=100_000))


BILLION = "a0: &a0 [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)
)


def test_metadata_with_aliases_are_not_used(tmp_path):
    path = packed(tmp_path, "file")
    metadata = path / "metadata.yaml"
    metadata.write_text(BILLION + metadata.read_text().replace("compression_format: zstd", "compression_format: *a11"))
    with pytest.raises(BadInput, match=r"metadata.yaml cannot be used: line 2 has the alias \*a0"):
        lengths(path, UnpackingLimits())
    metadata.write_text("#" * 3_000_000)
    with pytest.raises(BadInput, match="metadata.yaml has 3000000 bytes; at most 2000000 are read"):
        lengths(path, UnpackingLimits())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BILLION, r"line 2 has the alias \*a0"),
        ("a: &a [*a]", r"line 1 has the alias \*a"),
        ("[" * 80 + "]" * 80, "more than 100000 values or 50 levels"),
        ("{a: " * 8000, "levels|not YAML"),
        ("K: [" + "1," * 49_000 + "1]", None),
        ("# " + "x" * 100_000, "100002 bytes; at most 100000 are read"),
        ("fx: !!python/object/apply:os.system [ls]", "not YAML"),
    ],
)
def test_camera_files_that_stand_for_more_than_they_say(tmp_path, text, said):
    from PIL import Image

    Image.fromarray(np.full((4, 4), 800, np.uint16)).save(tmp_path / "depth.png")
    (tmp_path / "camera_info.yaml").write_text(text)
    with pytest.raises(BadInput, match=said or "no file with fx") as caught:
        read_recording(tmp_path)
    assert said is None or "camera_info.yaml" in str(caught.value)


def test_a_bomb_takes_no_memory(tmp_path):
    path = packed(tmp_path, "bz2", length=40_000_000)
    assert path.stat().st_size < 6000
    program = (
        "import sys; from pathlib import Path; from tests.memory import peak_megabytes\n"
        "from agent.recordings.decompression import UnpackingLimits\n"
        "from agent.recordings.bag_reader import open_bag\n"
        "before = peak_megabytes()\n"
        "with open_bag(Path(sys.argv[1]), UnpackingLimits(piece=1_000_000)) as bag:\n"
        "    try: list(bag.messages(bag.streams))\n"
        "    except Exception as error: print(type(error).__name__, peak_megabytes() - before < 15)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, path], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.stdout == "BadInput True\n", done
