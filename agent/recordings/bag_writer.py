"""Write bags to a new file or folder, which appears only when it is complete."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from agent.errors import BadInput, UsageError

SUFFIXES = (".bag", ".mcap", "")  # ROS 1, ROS 2 in one file, ROS 2 as a folder
START = 1_700_000_000.0  # s since 1970 at which sessions begin that have no time of their own: equal seeds, equal bags

# What the driver of the arm and ROS 1 say beyond the common types.
_MORE_TYPES = {
    "kinova_msgs/msg/JointAngles": "".join(f"float32 joint{k}\n" for k in range(1, 8)),
    "kinova_msgs/msg/FingerPosition": "".join(f"float32 finger{k}\n" for k in range(1, 4)),
}
_MORE_TYPES_1 = {"tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"}
_NO_TIME = QosTime(0, 0)
_LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, _NO_TIME, _NO_TIME,
    QosLiveliness.SYSTEM_DEFAULT, _NO_TIME, False,
)  # fmt: skip


def check_new(path: Path, force: bool = False) -> None:
    """Check early whether a bag can be written there.

    Args:
        path: the file, or the folder of a ROS 2 bag.
        force: whether an existing bag may be overwritten.

    Raises:
        UsageError: for a suffix of no bag format, or an existing path that must not be overwritten.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"--out cannot be {str(path)!r}; legal: a file that ends in .bag (ROS 1) or .mcap (ROS 2), or the name of "
            "a folder (ROS 2)"
        )
    if not os.path.lexists(path):
        return
    if path.is_dir() and (path.suffix or not _is_bag_folder(path)):
        raise UsageError(f"--out must be a new bag, but {str(path)!r} is a folder and not a bag")
    if path.is_file() and not path.suffix:
        raise UsageError(f"--out must be a new bag, but {str(path)!r} is a file and not a bag")
    if not force:
        raise UsageError(f"--out must be a new bag, but {str(path)!r} exists; --force overwrites it")


def _is_bag_folder(path: Path) -> bool:
    """Return whether a folder holds a ROS 2 bag and nothing else, so that overwriting loses nothing but a bag."""
    names = [entry.name for entry in path.iterdir()]
    return "metadata.yaml" in names and all(name == "metadata.yaml" or ".db3" in name for name in names)


class BagWriter:
    """A writer of a new bag; use it in a `with` block. After an error nothing is left behind.

    Args:
        path: .bag for ROS 1, .mcap for ROS 2 in one file, no suffix for a ROS 2 folder; folders on the way are made.
        force: overwrite an existing bag.

    Attributes:
        ros1: whether messages are those of ROS 1: their headers count, and matrices of cameras have capital letters.

    Raises:
        UsageError: for a path that cannot be a new bag.
        BadInput: if nothing can be written.
    """

    def __init__(self, path: Path, force: bool = False) -> None:
        check_new(path, force)
        self._path, self._force = path, force
        self.ros1 = path.suffix.lower() == ".bag"
        self._types = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        for name, definition in (_MORE_TYPES | (_MORE_TYPES_1 if self.ros1 else {})).items():
            self._types.register(get_types_from_msg(definition, name))
        self._topics: dict[str, tuple[Any, str, int]] = {}

    def __enter__(self) -> Self:
        with self._writing():
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._folder = Path(tempfile.mkdtemp(prefix=".bag-", dir=self._path.parent))
        is_mcap = self._path.suffix.lower() == ".mcap"
        self._unfinished = self._folder / (self._path.stem if is_mcap else self._path.name)
        if self.ros1:
            self._writer: Writer1 | Writer2 = Writer1(self._unfinished)
            self._writer.set_compression(Writer1.CompressionFormat.LZ4)
        elif is_mcap:
            self._writer = Writer2(self._unfinished, version=8, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        else:
            self._writer = Writer2(self._unfinished, version=8)
        try:
            with self._writing():
                self._writer.__enter__()
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with self._writing():
                self._writer.__exit__(kind, error, trace)
                if kind is None:
                    self._put()
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _put(self) -> None:
        """Move the finished bag to its place."""
        check_new(self._path, self._force)  # another program may have written there meanwhile
        finished = self._unfinished
        if finished.is_dir() and self._path.suffix:
            (finished,) = finished.glob("*.mcap")
        if self._path.is_dir():
            shutil.rmtree(self._path)
        os.replace(finished, self._path)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Convert errors of writing to `BadInput` with one sentence."""
        try:
            yield
        except OSError as error:
            raise BadInput(f"cannot write {str(self._path)!r}: {error.strerror or error}") from error

    def message(self, kind: str, **fields: Any) -> Any:
        """Return a message of the type "package/msg/Name"; every field must be given."""
        return self._types.types[kind](**fields)

    def header(self, seconds: float, frame: str = "") -> Any:
        """Return a header with the time since `START` and the frame of the message."""
        count = {"seq": 0} if self.ros1 else {}
        seconds_part, nanoseconds = divmod(_nanoseconds(seconds), 10**9)
        stamp = self.message("builtin_interfaces/msg/Time", sec=seconds_part, nanosec=nanoseconds)
        return self.message("std_msgs/msg/Header", **count, stamp=stamp, frame_id=frame)

    def write(self, topic: str, message: Any, seconds: float, latched: bool = False) -> None:
        """Write a message.

        Args:
            topic: its topic; all messages of a topic have one type.
            message: what `message` made; its header counts up by topic.
            seconds: the time of recording, since `START`.
            latched: whether later subscribers get the topic's last message.
        """
        kind = message.__msgtype__
        connection, known, count = self._topics.get(topic) or (self._connect(topic, kind, latched), kind, 0)
        if known != kind:
            raise ValueError(f"the topic {topic!r} carries {known}, not {kind}")
        self._topics[topic] = connection, kind, count + 1
        if self.ros1 and hasattr(message, "header"):
            message.header.seq = count
        serialize = self._types.serialize_ros1 if self.ros1 else self._types.serialize_cdr
        with self._writing():
            self._writer.write(connection, _nanoseconds(seconds), serialize(message, kind))

    def _connect(self, topic: str, kind: str, latched: bool) -> Any:
        if isinstance(self._writer, Writer1):
            latching = 1 if latched else None
            return self._writer.add_connection(topic, kind, typestore=self._types, latching=latching)
        profiles = [_LATCHED] if latched else []
        return self._writer.add_connection(topic, kind, typestore=self._types, offered_qos_profiles=profiles)


def _nanoseconds(seconds: float) -> int:
    return round(START) * 10**9 + round(seconds * 1e9)
