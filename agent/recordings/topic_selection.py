"""Select the topic for each role by type, name and first messages, unless the user names it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.errors import BadInput, UsageError
from agent.recordings.bag_reader import Bag, Message, Stream
from agent.recordings.image_decoding import DEPTHS, compressed_size, is_compressed_depth
from agent.recordings.message_decoding import CLOUD, COMPRESSED, IMAGE, INFO, frame_name, views_of
from agent.recordings.survey import look_at_first

ROLES = {  # what a topic can be named for -> the types that fit
    "points": (CLOUD,),
    "depth": (IMAGE, COMPRESSED),
    "depth_info": (INFO,),
    "color": (IMAGE, COMPRESSED),
    "joints": ("sensor_msgs/msg/JointState", "kinova_msgs/msg/JointAngles"),
}
_FIRST_LOOKS = 5  # messages of a topic that are looked at until one says something
_LIKED = ("aligned_depth_to_color", "depth_registered", "hw_registered", "sw_registered", "rect")  # in names
_DISLIKED = ("infra", "/ir/", "confidence", "fisheye", "mask", "marker", "debug")


@dataclass(frozen=True)
class Offer:
    """A possible use of a stream.

    Attributes:
        stream: the stream.
        role: "points", "depth", "color" or "depth_info" (any CameraInfo).
        frame: the optical frame.
        width, height: pixels; 0 if unknown.
        colored: whether a cloud has colours.
        problem: why it cannot be used, or "".
        views: the sizes of the pictures that a CameraInfo with a region or binning may be about.
        blank: whether its first raw picture of depths is all zero.
    """

    stream: Stream
    role: str
    frame: str = ""
    width: int = 0
    height: int = 0
    colored: bool = False
    problem: str = ""
    views: tuple[tuple[int, int], ...] = ()
    blank: bool = False

    def is_about(self, picture: Offer) -> bool:
        """Return whether a CameraInfo is for pictures of such a size."""
        return picture.size in (self.size, *self.views)

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height."""
        return self.width, self.height

    @property
    def rank(self) -> tuple[bool, bool, int, bool, str]:
        """Order offers for the same role, the best first."""
        name = self.stream.topic.lower()
        liked = next((place for place, word in enumerate(_LIKED) if word in name), len(_LIKED))
        disliked = any(word in name for word in _DISLIKED)
        return bool(self.problem), disliked, liked, self.stream.type == COMPRESSED, name


@dataclass(frozen=True)
class Choice:
    """The streams that make up the camera's picture: `points`, or `depth` with `depth_info`.

    Attributes:
        points: a cloud, or `None`.
        depth: a depth picture, or `None`.
        depth_info: the CameraInfo of the depth picture, or of an organised cloud.
        color: a colour picture, or `None`.
        color_info: the CameraInfo of the colour image, if it has to be aligned with the depth.
        aligned: whether the pixels of the colour image correspond to the points.
    """

    points: Offer | None = None
    depth: Offer | None = None
    depth_info: Offer | None = None
    color: Offer | None = None
    color_info: Offer | None = None
    aligned: bool = False

    @property
    def source(self) -> Offer:
        """Return the source of the points."""
        chosen = self.points or self.depth
        assert chosen is not None
        return chosen

    @property
    def worth(self) -> float:
        """Rate the content: a picture above unorganised points, colour on every pixel above colour laid over it."""
        if self.points is not None and self.points.height <= 1:
            return 1.5 if self.points.colored else 1.0
        own = self.points is not None and self.points.colored
        return 2.0 + (2.0 if own or self.color and self.aligned else 1.0 if self.color else 0.0)


def offers(bag: Bag) -> list[Offer]:
    """Return the possible uses of every stream of a fitting type, from its first messages."""
    streams = [stream for stream in bag.streams if stream.count and stream.type in (CLOUD, IMAGE, COMPRESSED, INFO)]
    found = {stream: Offer(stream, _guessed_role(stream), problem="it has no messages") for stream in streams}
    looks: Counter[Stream] = Counter()

    def enough(message: Message) -> bool:
        """Keep what the first usable message says, or the first one if none is of use."""
        stream = message.stream
        looks[stream] += 1
        offer = _offer(bag, message)
        if not offer.problem or looks[stream] == 1:
            found[stream] = offer
        return not offer.problem or looks[stream] == _FIRST_LOOKS

    look_at_first(bag, streams, enough)
    return sorted(found.values(), key=lambda offer: offer.rank)


def _guessed_role(stream: Stream) -> str:
    by_name = "depth" if "depth" in stream.topic.lower() else "color"
    return {CLOUD: "points", INFO: "depth_info"}.get(stream.type, by_name)


def _offer(bag: Bag, message: Message) -> Offer:
    """Return the use of a stream as one of its messages shows it."""
    stream = message.stream
    try:
        return _described(stream, bag.decoded(message))
    except BadInput as error:
        return Offer(stream, _guessed_role(stream), problem=str(error))


def _described(stream: Stream, message: Any) -> Offer:
    """Describe a stream by one of its messages."""
    frame = frame_name(message.header.frame_id)
    role, problem = {CLOUD: "points", INFO: "depth_info"}.get(stream.type, "color"), ""
    if stream.type == COMPRESSED:
        if is_compressed_depth(stream.topic, message.format):
            role = "depth"
        width, height = compressed_size(message)
    else:
        width, height = message.width, message.height
    if stream.type == IMAGE:
        depths = message.encoding in DEPTHS and (message.encoding != "mono16" or "depth" in stream.topic)
        role = "depth" if depths else "color"
    if role != "depth_info" and not (width and height):
        problem = f"its first pictures are {width} x {height} pixels"
    colored = role == "points" and any(field.name.lower() in ("rgb", "rgba", "r") for field in message.fields)
    views = tuple(view.size for view in views_of(message)) if stream.type == INFO else ()
    blank = role == "depth" and stream.type == IMAGE and not problem and not np.any(message.data)
    return Offer(stream, role, frame, width, height, colored, problem, views, blank)


def choose(bag: Bag, named: Mapping[str, str], there: list[Offer] | None = None) -> Choice:
    """Choose the streams that make the camera's picture.

    Args:
        bag: open.
        named: role -> the topic that the user named for it.
        there: the `offers` of the bag, where they are known.

    Raises:
        UsageError: for a role that there is none of.
        BadInput: if a topic is missing, or no topic has points or depth.
    """
    check_named(bag, named)
    there = offers(bag) if there is None else there
    clouds, depths = _of_role(there, "points", named), _of_role(there, "depth", named)
    if "depth" in named:
        clouds = []
    elif "points" in named:
        depths = []
    choices = [_with_color(there, named, Choice(points=offer)) for offer in clouds]
    without_info = []
    for offer in depths:
        info = _info_for(there, named, offer)
        if info is None:
            without_info.append(offer)
        else:
            choices.append(_with_color(there, named, Choice(depth=offer, depth_info=info)))
    usable = [choice for choice in choices if not choice.source.problem]
    if usable:  # the first of the best; on a par a depth picture goes first, which brings its lens along
        return max(usable, key=lambda choice: (not choice.source.blank, choice.worth, choice.depth is not None))
    sources = [*(choice.source for choice in choices), *without_info]
    if sources and all(source.problem for source in sources):
        raise BadInput(f"{sources[0].stream.topic} of {str(bag.path)!r} cannot be used: {sources[0].problem}")
    if without_info:
        topic = without_info[0].stream.topic
        infos = [offer.stream.topic for offer in there if offer.role == "depth_info"]
        rest = f"it has these: {', '.join(infos)}" if infos else "it has none at all"
        raise BadInput(
            f"{str(bag.path)!r} has depths on {topic} but no sensor_msgs/CameraInfo that goes with them "
            f"(--topic depth_info=TOPIC names one); {rest}"
        )
    raise BadInput(
        f"{str(bag.path)!r} has nothing that a depth camera measured: no sensor_msgs/PointCloud2 and no "
        f"sensor_msgs/Image of depths ({', '.join(DEPTHS)}); it has {_listed(bag)}"
    )


def check_named(bag: Bag, named: Mapping[str, str]) -> None:
    """Check that every topic that the user names exists and has a fitting type.

    Raises:
        UsageError: for an unknown role, or for two that exclude each other.
        BadInput: for a topic that is not there.
    """
    for role, topic in named.items():
        if role not in ROLES:
            raise UsageError(f"--topic cannot name a topic for {role!r}; legal: {', '.join(ROLES)}")
        fitting = sorted({stream.topic for stream in bag.streams if stream.count and stream.type in ROLES[role]})
        if topic not in fitting:
            types = " or ".join(kind.replace("/msg/", "/") for kind in ROLES[role])
            rest = ", ".join(fitting) or f"none; it has {_listed(bag)}"
            raise BadInput(f"{str(bag.path)!r} has no topic {topic!r} of {types} for {role}; legal: {rest}")
    if "points" in named and "depth" in named:
        raise UsageError("--topic takes points or depth, not both")


def _of_role(there: list[Offer], role: str, named: Mapping[str, str]) -> list[Offer]:
    """Return the offers for a role, or the topic that the user named for it, without further conditions."""
    if role in named:
        return [offer for offer in there if offer.stream.topic == named[role] and offer.stream.type in ROLES[role]]
    return [offer for offer in there if offer.role == role]


def _info_for(there: list[Offer], named: Mapping[str, str], picture: Offer) -> Offer | None:
    """Return the CameraInfo of an image: the named one, the one in its namespace, or one with its frame and size."""
    if picture.role in ("depth", "points") and "depth_info" in named:
        return _of_role(there, "depth_info", named)[0]
    infos = [offer for offer in there if offer.role == "depth_info" and not offer.problem]
    beside = f"{_folder(picture.stream)}/camera_info"
    fits = [
        lambda info: info.stream.topic == beside,
        lambda info: info.frame == picture.frame and info.is_about(picture),
        lambda info: info.is_about(picture) and "depth" in info.stream.topic and picture.role == "depth",
        lambda info: info.is_about(picture) and len(infos) == 1,
    ]
    return next((info for fit in fits for info in infos if fit(info)), None)


def _folder(stream: Stream) -> str:
    """Return the part of a picture's name that its CameraInfo shares."""
    topic = stream.topic.rsplit("/", 1)[0] if stream.type == COMPRESSED else stream.topic
    return topic.rsplit("/", 1)[0]


def _with_color(there: list[Offer], named: Mapping[str, str], choice: Choice) -> Choice:
    """Return the choice with the most suitable colour picture."""
    source, info = choice.source, choice.depth_info
    if choice.points is not None:
        info = _info_for(there, named, source) if source.height > 1 else None
        if source.colored and "color" not in named:
            return Choice(points=source, depth_info=info)
    whole = Choice(choice.points, choice.depth, info)
    for color in _colors_for(there, named, source):
        if color.problem and "color" not in named:
            continue
        same_size, name = color.size == source.size and source.height > 1, source.stream.topic
        registered = "registered" in name or "aligned_depth_to_color" in name
        if same_size and (color.frame == source.frame or registered):
            return Choice(choice.points, choice.depth, info, color, None, True)
        color_info = _info_for(there, {}, color)
        if color_info is not None and whole.color is None:
            whole = Choice(choice.points, choice.depth, info, color, color_info, False)
    return whole


def _colors_for(there: list[Offer], named: Mapping[str, str], source: Offer) -> list[Offer]:
    """Return the colour pictures that may go with a source, those of its own camera first.

    A picture in the namespace and the frame of another camera belongs to what that one measures, unless the user names
    it.
    """
    colors = _of_role(there, "color", named)
    if "color" in named:
        return colors
    others = [offer for offer in there if offer.role in ("depth", "points")]
    own = [
        color
        for color in colors
        if color.frame == source.frame
        or _of_one_camera(color, source)
        or not any(_of_one_camera(color, other) for other in others)
    ]
    return sorted(own, key=lambda color: not _of_one_camera(color, source))


def _of_one_camera(one: Offer, other: Offer) -> bool:
    """Return whether two topics are in one camera's namespace: /camera/color/image and /camera/depth/color/points."""
    shorter, longer = sorted((f"{_folder(offer.stream).rpartition('/')[0]}/" for offer in (one, other)), key=len)
    return longer.startswith(shorter)


def _listed(bag: Bag, most: int = 8) -> str:
    """List the bag's streams in a sentence."""
    listed = [str(stream).replace("/msg/", "/") for stream in bag.streams]
    return ", ".join(listed[:most]) + (f" and {len(listed) - most} more" if len(listed) > most else "")
