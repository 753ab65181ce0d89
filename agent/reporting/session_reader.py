"""Read session files (see `agent.reporting.session_format`), including those of earlier schema versions."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import BadInput
from agent.rendering.image_files import FORMAT, Picture
from agent.reporting.event_schema import payload_conflict, payload_error
from agent.reporting.session_format import (
    READABLE_VERSIONS,
    SCHEMA_VERSION,
    decode_line,
    is_start,
    upgrade_payload,
    upgrade_picture_name,
)
from agent.reporting.table_parts import part_error
from structdiffusion.limits import SESSION_BYTES, SESSION_START_BYTES


@dataclass(frozen=True)
class SessionLine:
    """One line of a session: an event, a picture, or a part of the table in 3D.

    Attributes:
        seconds: working time since the session began; the parts of a continued session are added up.
        event: the event's JSON form, or `None`.
        picture: the picture, or `None`.
        table: the part of the table, or `None`.
    """

    seconds: float
    event: Mapping[str, Any] | None = None
    picture: Picture | None = None
    table: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Session:
    """The content of a session file.

    Attributes:
        version: the version of structagent that wrote it.
        started: the time when it began, in ISO 8601.
        machine: a description of the machine.
        options: the options of the command.
        lines: events and pictures, in order.
    """

    version: str
    started: str
    machine: str
    options: Mapping[str, Any]
    lines: tuple[SessionLine, ...]


def read_session(path: Path) -> Session:
    """Read a session file.

    An incomplete line is ignored where a killed process may have left one: at the end, and before a further first line.

    Raises:
        BadInput: if the file does not exist, is not a session, has an unknown schema version, or has an invalid line;
            the message has the line's number.
    """
    try:
        with path.open("rb") as file:  # a pipe is read once
            content = file.read(SESSION_START_BYTES)
            if is_start(decode_line(content.lstrip().partition(b"\n")[0])):
                content += file.read(SESSION_BYTES + 1 - len(content))
    except OSError as error:
        raise BadInput(f"cannot read the session {str(path)!r}: {error.strerror}") from error
    if len(content) > SESSION_BYTES:
        raise BadInput(f"the session {str(path)!r} has more than {SESSION_BYTES} bytes, and no more are read")
    texts = content.split(b"\n")
    entries = [(number, decode_line(text)) for number, text in enumerate(texts, start=1) if text.strip()]
    if not entries or not is_start(entries[0][1]):
        raise BadInput(f"{str(path)!r} is not a session of structagent: its first line does not identify one")
    first: Mapping[str, Any] = entries[0][1]
    return Session(
        str(first["version"]), first["started"], str(first["machine"]), first["options"], tuple(_lines(path, entries))
    )


def _lines(path: Path, entries: list[tuple[int, Any]]) -> Iterator[SessionLine]:
    before = latest = 0.0
    version = SCHEMA_VERSION
    part = 0  # how many objects of the scene take part
    for place, (number, entry) in enumerate(entries):
        where = f"line {number} of {str(path)!r}"
        if is_start(entry):
            version = entry["schema_version"]
            if version not in READABLE_VERSIONS:
                legal = " and ".join(map(str, READABLE_VERSIONS))
                raise BadInput(f"{where} has schema version {version!r}; this structagent reads {legal}")
            before = latest
        elif entry is None:
            if place + 1 < len(entries) and not is_start(entries[place + 1][1]):
                raise BadInput(f"{where} is not JSON")
        else:
            line = _session_line(entry, where, version)
            latest = before + line.seconds
            if line.event is not None:
                problem = payload_conflict(line.event, part)
                if problem:
                    raise BadInput(f"{where}: {problem}")
                if line.event["kind"] == "perceived":
                    part = sum(seen["takes_part"] for seen in line.event["objects"])
            yield SessionLine(latest, line.event, line.picture, line.table)


def _session_line(entry: Any, where: str, version: int) -> SessionLine:
    seconds = entry.get("seconds") if isinstance(entry, dict) else None
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 <= seconds < float("inf"):
        raise BadInput(f'{where} must be an object with "seconds", a number from 0')
    if "event" in entry:
        payload = upgrade_payload(entry["event"], version)
        problem = payload_error(payload)
        if problem:
            raise BadInput(f"{where}: {problem}")
        return SessionLine(seconds, event=payload)
    if "table" in entry:
        if problem := part_error(entry["table"]):
            raise BadInput(f"{where}: {problem}")
        return SessionLine(seconds, table=entry["table"])
    picture = entry.get("picture")
    keys = ("name", "caption", "format", "data")
    if not isinstance(picture, dict) or not all(isinstance(picture.get(key), str) for key in keys):
        raise BadInput(f'{where} must have an "event", a "table", or a "picture" with the strings {", ".join(keys)}')
    if picture["format"] != FORMAT:
        raise BadInput(f"{where}: the format of a picture cannot be {picture['format']!r}; legal: {FORMAT}")
    try:
        data = base64.b64decode(picture["data"], validate=True)
    except (binascii.Error, ValueError) as error:
        raise BadInput(f"{where}: the picture's data is not base64") from error
    name = upgrade_picture_name(picture["name"], version)
    return SessionLine(seconds, picture=Picture(name, picture["caption"], data))
