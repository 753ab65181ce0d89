"""Read bags of every kind as a stream: ROS 1 files, ROS 2 folders, .db3 and .mcap files.

Every error that a damaged file causes in the library becomes one sentence here. Messages are decoded by the
definitions that ROS itself publishes and never by those in the bag: the types that are used have not changed in any
release, and what comes with a foreign file should not become code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from textwrap import shorten
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import ReaderError as Reader1Error
from rosbags.rosbag2 import Reader as Reader2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.msg import normalize_msgtype
from rosbags.typesys.store import Typestore

from agent.errors import AgentError, BadInput, one_sentence
from agent.recordings.decompression import Unpacking, UnpackingLimits
from agent.recordings.file_view import NothingWhole, RepairedFile
from agent.recordings.mcap_repair import as_ros2, repaired_mcap
from agent.recordings.ros1_repair import repaired_ros1
from agent.recordings.sizes import check_message
from agent.runtime.progress import report_when_slow
from agent.runtime.yaml_files import check_yaml
from structdiffusion.limits import METADATA_BYTES

STORAGES = (".db3", ".mcap")  # of ROS 2
SUFFIXES = (".bag", *STORAGES)
METADATA = "metadata.yaml"
_BEGINNINGS = {
    ".bag": ("ROS 1 bag", b"#ROSBAG V2.0\n"),
    ".db3": ("ROS 2 database", b"SQLite format 3\0"),
    ".mcap": ("ROS 2 MCAP file", b"\x89MCAP0\r\n"),
}
_MENDED_BY = {".bag": "rosbag reindex", ".db3": "sqlite3 FILE .recover", ".mcap": "mcap recover"}  # where there is ROS

# Published with packages that are not in the library's collections.
_MORE_TYPES = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "kinova_msgs/msg/JointAngles": "\n".join(f"float32 joint{number}" for number in range(1, 8)),
}
_SAME_AS = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}  # before ROS had a second tf


@dataclass(frozen=True)
class Stream:
    """The messages of one type on one topic; a topic may carry several types.

    Attributes:
        topic: its name.
        type: such as "sensor_msgs/msg/Image".
        count: the number of messages, according to the bag.
        connections: the bag's own entries for it.
    """

    topic: str
    type: str
    count: int
    connections: tuple[Connection, ...] = field(repr=False, compare=False)

    def __str__(self) -> str:
        return f"{self.topic} ({self.type})"


@dataclass(frozen=True)
class Message:
    """One message, not yet decoded.

    Attributes:
        stream: the stream that it belongs to.
        recorded: when it was recorded, nanoseconds.
        raw: the bytes of the message.
    """

    stream: Stream
    recorded: int
    raw: bytes


class Bag:
    """An open bag.

    Attributes:
        path: the file or folder.
        start, end: when its first and its last message were recorded, nanoseconds.
        streams: its streams, by topic and type.
        notes: repairs that were needed to read it, a sentence each.
    """

    def __init__(self, path: Path, reader: Reader1 | Reader2, notes: Sequence[str], unpacking: Unpacking) -> None:
        self.path, self.notes, self._reader, self._unpacking = path, tuple(notes), reader, unpacking
        by_name: dict[tuple[str, str], list[Connection]] = {}
        for connection in reader.connections:
            by_name.setdefault((connection.topic, normalize_msgtype(connection.msgtype)), []).append(connection)
        self.streams = tuple(
            Stream(topic, kind, sum(connection.msgcount for connection in connections), tuple(connections))
            for (topic, kind), connections in sorted(by_name.items())
        )
        if not any(stream.count for stream in self.streams):
            raise BadInput("; ".join((f"{str(path)!r} holds no messages", *notes)))
        with _as_bad_input(f"cannot find out when {str(path)!r} was recorded"):
            self.start, self.end = int(reader.start_time), int(reader.end_time) - 1
        self._ros1 = isinstance(reader, Reader1) or any(_is_ros1(connection) for connection in reader.connections)
        self._types = _known_types(self._ros1)

    @property
    def seconds(self) -> float:
        """Return the duration of the recording."""
        return (self.end - self.start) / 1e9

    def messages(
        self, streams: Sequence[Stream], start: int | None = None, stop: int | None = None
    ) -> Iterator[Message]:
        """Read the messages of `streams` that were recorded from `start` to before `stop` (nanoseconds), in that order.

        Raises:
            BadInput: if the bag is damaged.
        """
        stream_of = {connection[:3]: stream for stream in streams for connection in stream.connections}
        if not stream_of:
            return
        connections = [connection for stream in streams for connection in stream.connections]
        found = self._reader.messages(connections, start, stop)
        while True:
            with _as_bad_input(f"cannot read on in {str(self.path)!r}"), self._unpacking.counted():
                item = next(found, None)
                if item is None:
                    return
                self._unpacking.take_message()
                connection, recorded, raw = item
                message = Message(stream_of[connection[:3]], int(recorded), bytes(raw))
            yield message

    def decoded(self, message: Message) -> Any:
        """Decode a message into the fields that its type has.

        Raises:
            BadInput: if its bytes do not fit that type.
        """
        kind = _SAME_AS.get(message.stream.type, message.stream.type)
        with _as_bad_input(f"cannot decode a message on {message.stream.topic} as {message.stream.type}"):
            check_message(kind, message.raw, self._ros1)
            if self._ros1:
                return self._types.deserialize_ros1(message.raw, kind)
            return self._types.deserialize_cdr(message.raw, kind)


@contextmanager
def open_bag(path: Path, limits: UnpackingLimits = UnpackingLimits()) -> Iterator[Bag]:
    """Open the bag at `path` for a `with` block.

    Args:
        path: the file or folder.
        limits: the limits for unpacked data.

    Raises:
        BadInput: if it is not a bag, or too damaged to be read.
    """
    if not path.exists():
        raise BadInput(f"there is no {str(path)!r}")
    unpacking = Unpacking(path, limits)
    with report_when_slow(f"reading {str(path)!r}", unpacking.is_slow):
        with unpacking.counted():
            reader, notes = _opened(path)
        try:
            _check_index(reader)
            yield Bag(path, reader, notes, unpacking)
        finally:
            reader.close()


def _opened(path: Path) -> tuple[Reader1 | Reader2, list[str]]:
    """Open a reader of the bag; return it and the notes on repairs."""
    if path.is_dir():
        return _opened_folder(path)
    if path.suffix not in SUFFIXES:
        raise BadInput(
            f"{str(path)!r} is not a bag: legal are {', '.join(SUFFIXES)}, and the folder of a ROS 2 bag; "
            "`bag objects` and --scene take clouds (.ply, .pcd) and folders of pictures too"
        )
    if path.stat().st_size == 0:
        raise BadInput(f"{str(path)!r} is empty")
    kind, beginning = _BEGINNINGS[path.suffix]
    with _as_bad_input(f"cannot read {str(path)!r} as a {kind}", _MENDED_BY[path.suffix]):
        with path.open("rb") as file:
            header = file.read(100)
        begins = header[: len(beginning)]
        if begins != beginning:
            raise BadInput(
                f"{str(path)!r} is not a {kind}: it begins with {begins!r}, where a {kind} begins with {beginning!r}"
            )
        if path.suffix == ".db3":
            return _opened_reader(path), _cut_note(path, header)
        try:
            return _opened_reader(path if path.suffix == ".bag" else as_ros2(path)), []
        except Exception:  # as in `_as_bad_input`
            repaired = _repaired(path)
            if repaired is None:
                raise
            return _opened_reader(repaired), [repaired.note]


def _opened_reader(path: Path | RepairedFile) -> Reader1 | Reader2:
    """Open the library's reader of a file."""
    reader = Reader1(path) if path.suffix == ".bag" else Reader2(path)  # type: ignore[arg-type]
    reader.open()
    return reader


def _repaired(path: Path) -> RepairedFile | None:
    """Return the file without its damaged end, or `None` if nothing of it is whole."""
    try:
        return repaired_ros1(path) if path.suffix == ".bag" else repaired_mcap(path)
    except (NothingWhole, Reader1Error):
        return None


def _is_ros1(connection: Connection) -> bool:
    """Return whether the messages of an MCAP file's channel are packed as in ROS 1."""
    return getattr(connection.ext, "serialization_format", "") == "ros1"


def _check_index(reader: Reader1 | Reader2) -> None:
    """Refuse an MCAP file whose index names a chunk more than once, as it would be in memory as often."""
    if isinstance(reader, Reader2):
        for storage in getattr(reader.storage, "storages", [reader.storage]):
            places = [chunk.chunk_start_offset for chunk in getattr(storage, "chunks", ())]
            if len(set(places)) < len(places):
                raise BadInput(f"the index of {str(storage.path)!r} is damaged: it names one of its chunks twice")


def _check_metadata(path: Path) -> None:
    """Refuse metadata that are too large or that expand to more than they contain."""
    if (size := path.stat().st_size) > METADATA_BYTES:
        raise BadInput(f"its {path.name} has {size} bytes; at most {METADATA_BYTES} are read")
    try:
        check_yaml(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise BadInput(f"its {path.name} cannot be used: {error}") from error


def _cut_note(path: Path, header: bytes) -> list[str]:
    """Note that a database is truncated if its header counts more pages than it has; SQLite does not report this."""
    page, counted = int.from_bytes(header[16:18], "big"), int.from_bytes(header[28:32], "big")
    there, needed = path.stat().st_size, (65536 if page == 1 else page) * counted
    return [f"{path.name} is cut short at {there} of {needed} bytes; what is left was read"] if there < needed else []


def _opened_folder(path: Path) -> tuple[Reader1 | Reader2, list[str]]:
    """Open a ROS 2 folder by its metadata, or by its only file if the metadata cannot be used."""
    reason = f"it has no {METADATA}"
    if (path / METADATA).exists():
        try:
            with _as_bad_input(f"its {METADATA} cannot be used"):
                _check_metadata(path / METADATA)
                reader = Reader2(path)
                reader.open()
            return reader, []
        except BadInput as error:
            reason = str(error)
    files = sorted(file for file in path.iterdir() if file.suffix in STORAGES)
    if len(files) != 1:
        there = f"{len(files)} files that end in {' or '.join(STORAGES)}"
        raise BadInput(f"cannot read the folder {str(path)!r} as a ROS 2 bag: {reason}; besides, it has {there}")
    opened, notes = _opened(files[0])
    return opened, [f"of the folder {files[0].name} was read alone: {reason}", *notes]


@cache
def _known_types(ros1: bool) -> Typestore:
    """Return the message types used for decoding."""
    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, definition in _MORE_TYPES.items():
        if name not in types.fielddefs:
            types.register(get_types_from_msg(definition, name))
    return types


@contextmanager
def _as_bad_input(what: str, mended_by: str = "") -> Iterator[None]:
    """Convert any error of the library on damaged data into one sentence that begins with `what`.

    The library documents no error types: truncated files and altered bytes were seen to raise nearly every kind.
    """
    try:
        yield
    except AgentError:
        raise
    except OSError as error:
        raise BadInput(f"{what}: {error.strerror or one_sentence(error)}") from error
    except Exception as error:
        said = one_sentence(error)
        if not type(error).__module__.startswith("rosbags"):
            said = f"{type(error).__name__}: {said}"
        reason = shorten(said, 160, placeholder=" ...").rstrip(".")
        mending = f"; `{mended_by}` saves what is whole" if mended_by else ""
        raise BadInput(f"{what}: it is damaged or cut short ({reason}){mending}") from error
