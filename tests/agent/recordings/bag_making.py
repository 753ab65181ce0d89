"""Small bags for tests, written by the library's own writers from plain values, well made or badly."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_600_000_000  # s
WIDTH, HEIGHT = 40, 30
MATRIX = np.array(((35.0, 0, 19.5), (0, 35, 14.5), (0, 0, 1)))
OPTICAL = "camera_color_optical_frame"
DEPTH, COLOR = "/camera/aligned_depth_to_color/image_raw", "/camera/color/image_raw"
DEPTH_INFO, COLOR_INFO = "/camera/aligned_depth_to_color/camera_info", "/camera/color/camera_info"
JOINTS = "/j2s7s300_driver/out/joint_state"
HOME = (4.71, 2.84, 0.0, 0.75, 4.62, 4.48, 4.88)
ARM = tuple(f"j2s7s300_joint_{number}" for number in range(1, 8))

_MORE_TYPES = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "tf/msg/tfMessage": "geometry_msgs/TransformStamped[] transforms",
    "kinova_msgs/msg/JointAngles": "\n".join(f"float32 joint{number}" for number in range(1, 8)),
}


@dataclass
class Said:
    """A message: `fields` are plain values, "header" is (frame, seconds), or `raw` is what is written instead."""

    topic: str
    type: str
    fields: dict[str, Any]
    seconds: float = 0.0
    raw: bytes | None = None


def write_bag(path: Path, messages: Iterable[Said], packed: bool = False) -> Path:
    """A bag of any kind: .bag, .mcap, .db3, or a folder where there is no suffix; an .mcap may be packed."""
    ros1 = path.suffix == ".bag"
    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, definition in _MORE_TYPES.items():
        if name not in types.fielddefs:
            types.register(get_types_from_msg(definition, name))
    if ros1:
        writer: Any = Writer1(path)
    else:
        plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
        folder = path.with_name(f"{path.stem}_folder") if path.suffix else path
        writer = Writer2(folder, version=8, storage_plugin=plugin)
        if packed:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections: dict[tuple[str, str], Any] = {}
        for said in messages:
            key = said.topic, said.type
            if key not in connections:
                connections[key] = writer.add_connection(*key, typestore=types)
            data = said.raw
            if data is None:
                message = _made(types, said.type, said.fields, ros1)
                serialize = types.serialize_ros1 if ros1 else types.serialize_cdr
                data = bytes(serialize(message, said.type))
            writer.write(connections[key], nanoseconds(said.seconds), data)
    if path.suffix in (".mcap", ".db3"):
        next(folder.glob(f"*{path.suffix}")).rename(path)
    return path


def nanoseconds(seconds: float) -> int:
    return START * 10**9 + round(seconds * 1e9)


def _made(types: Any, kind: str, fields: dict[str, Any], ros1: bool) -> Any:
    """A message of a type; dictionaries become messages, what is not given is nothing."""
    _, described = types.fielddefs[kind]
    given = {name.lower(): value for name, value in fields.items()}
    values = {}
    for name, (node, what) in described:
        value = given.get(name.lower())
        if name == "header":
            frame, seconds = given.get("header", ("", 0.0))
            stamp = types.types["builtin_interfaces/msg/Time"](*divmod(nanoseconds(seconds), 10**9))
            count = {"seq": 0} if ros1 else {}
            value = types.types["std_msgs/msg/Header"](**count, stamp=stamp, frame_id=frame)
        elif node == 2:
            value = _made(types, what, value or {}, ros1)
        elif node in (3, 4) and what[0][0] == 2:
            value = [_made(types, what[0][1], entry, ros1) for entry in value or ()]
        elif node in (3, 4) and what[0][1][0] == "string":
            value = list(value or ())
        elif node in (3, 4):
            dtype = {"float32": "f4", "float64": "f8", "uint8": "u1"}[what[0][1][0]]
            value = np.asarray(value if value is not None else np.zeros(what[1] if node == 3 else 0), dtype).ravel()
        elif value is None:
            value = "" if what[0] == "string" else 0
        values[name] = value
    return types.types[kind](**values)


def depths() -> np.ndarray:
    """A slanted plane (H, W), metres, each a whole number of millimetres."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return (700 + 5 * rows + columns) / 1000


def plane_points(depth: np.ndarray) -> np.ndarray:
    """What the lens makes of depths: (H, W, 3)."""
    rows, columns = np.mgrid[: depth.shape[0], : depth.shape[1]]
    x = (columns - MATRIX[0, 2]) / MATRIX[0, 0] * depth
    y = (rows - MATRIX[1, 2]) / MATRIX[1, 1] * depth
    return np.stack((x, y, depth), axis=-1)


def colors() -> np.ndarray:
    """A picture (H, W, 3) in which every pixel differs."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return np.stack((6 * columns, 8 * rows, rows + columns), axis=-1).astype(np.uint8)


def image(
    topic: str, pixels: np.ndarray, encoding: str, seconds: float = 0.0, frame: str = OPTICAL, **more: Any
) -> Said:
    """A raw Image."""
    fields = {
        "header": (frame, seconds),
        "height": pixels.shape[0],
        "width": pixels.shape[1],
        "encoding": encoding,
        "step": pixels.nbytes // pixels.shape[0],
        "data": np.frombuffer(np.ascontiguousarray(pixels).tobytes(), np.uint8),
    }
    return Said(topic, "sensor_msgs/msg/Image", fields | more, seconds)


def depth_image(depth: np.ndarray, seconds: float = 0.0, topic: str = DEPTH, frame: str = OPTICAL) -> Said:
    """Depths as 16UC1."""
    return image(topic, np.rint(np.nan_to_num(depth) * 1000).astype("<u2"), "16UC1", seconds, frame)


def camera_info(topic: str, seconds: float = 0.0, frame: str = OPTICAL, **more: Any) -> Said:
    """A lens without distortion."""
    fields = {
        "header": (frame, seconds),
        "height": HEIGHT,
        "width": WIDTH,
        "distortion_model": "plumb_bob",
        "d": np.zeros(5),
        "k": MATRIX,
        "p": np.hstack((MATRIX, np.zeros((3, 1)))),
    }
    return Said(topic, "sensor_msgs/msg/CameraInfo", fields | more, seconds)


def joints(
    seconds: float = 0.0, names: Iterable[str] = ARM, angles: Iterable[float] = HOME, topic: str = JOINTS
) -> Said:
    """A JointState."""
    fields = {"header": ("", seconds), "name": list(names), "position": list(angles)}
    return Said(topic, "sensor_msgs/msg/JointState", fields, seconds)


def transform(
    parent: str,
    child: str,
    shift: tuple[float, float, float] = (0, 0, 0),
    turn: tuple[float, float, float, float] = (0, 0, 0, 1),
    seconds: float = 0.0,
    topic: str = "/tf_static",
    kind: str = "tf2_msgs/msg/TFMessage",
) -> Said:
    """One transform; `turn` is x, y, z, w."""
    stood = {"translation": dict(zip("xyz", shift)), "rotation": dict(zip("xyzw", turn))}
    said = {"header": (parent, seconds), "child_frame_id": child, "transform": stood}
    return Said(topic, kind, {"transforms": [said]}, seconds)


def cloud(points: np.ndarray, seconds: float = 0.0, topic: str = "/camera/depth_registered/points") -> Said:
    """A PointCloud2 of x, y and z alone, from (H, W, 3)."""
    data = points.astype("<f4")
    fields = {
        "header": (OPTICAL, seconds),
        "height": data.shape[0],
        "width": data.shape[1],
        "fields": [{"name": axis, "offset": 4 * k, "datatype": 7, "count": 1} for k, axis in enumerate("xyz")],
        "point_step": 12,
        "row_step": 12 * data.shape[1],
        "data": np.frombuffer(data.tobytes(), np.uint8),
    }
    return Said(topic, "sensor_msgs/msg/PointCloud2", fields, seconds)


def session(seconds: Iterable[float] = (0.1, 0.2, 0.3)) -> list[Said]:
    """A whole small session: aligned depth, lens, colour, joints, tf."""
    said = [
        transform("world", "root"),
        transform("root", "j2s7s300_link_base"),
        transform("world", "camera_link", (0.1, -0.9, 0.6)),
        transform("camera_link", OPTICAL, (0, 0.01, 0), (-0.5, 0.5, -0.5, 0.5)),
    ]
    for when in seconds:
        said += [
            joints(when),
            camera_info(DEPTH_INFO, when),
            camera_info(COLOR_INFO, when),
            depth_image(depths(), when),
            image(COLOR, colors(), "rgb8", when),
        ]
    return said


def quantised_header(a: float = 0.0, b: float = 0.0) -> bytes:
    """What stands before the PNG of a compressedDepth picture."""
    return struct.pack("<iff", 0, a, b)
