"""Track which output folders and files this tool wrote, so that nothing else is replaced or deleted.

A folder that a command writes into gets a marker, `.structagent.json`:

    {"marker_version": 1, "kind": "run", "files": ["report.html", "report.json", "scene-before.webp"]}

A command takes a folder that is missing, empty, or marked with its own kind. Folders of earlier versions, which have no
marker, are recognised by their report, results or session. `--force` takes any other folder; foreign files
then stay, unless they have the name of a file that is written. Only files that the marker lists are deleted, and only
in the folder itself: no paths, no symbolic links, no folders.

A command asks twice: by path before any work, and in the opened folder when it writes (`own_folder`). What a link has
put in the folder's place meanwhile is therefore judged, and refused, like any other folder.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError
from agent.runtime.output_paths import check_folder
from grounding.atomic_files import OpenFolder, opened

MARKER = ".structagent.json"
_LOCK = ".lock"  # may stay behind in a folder in which nothing else was written
_VERSION = 1
_KINDS = {"run": "a run", "chat": "a chat", "batch": "a batch", "evaluation": "an evaluation"}
_LARGEST_REPORT = 64 * 2**20  # bytes; a larger file is no report of a run

Recognise = Callable[[OpenFolder], bool]


@dataclass(frozen=True)
class OwnFolder:
    """The output folder of a command.

    Attributes:
        folder: made if needed.
        kind: of what it holds: "run", "chat", "batch" or "evaluation".
    """

    folder: Path
    kind: str

    def write(self, name: str, content: bytes) -> Path:
        """Write a file into it, as one of this tool's own; return its path.

        Raises:
            UsageError: if the folder contains files that this kind of command did not write.
            OSError: if it cannot be written.
        """
        with own_folder(self.folder, self.kind) as place:
            mark(place, self.kind, files_written(place, self.kind) | {name})
            place.write({name: content})
        return self.folder / name


def check_own_folder(folder: Path | None, kind: str, force: bool = False) -> None:
    """Refuse an output folder that commands of this `kind` must not write into; nothing is written.

    Args:
        folder: the value of `--out`; `None` if there is no output.
        kind: "run", "chat", "batch" or "evaluation".
        force: accept any folder, whatever it contains.

    Raises:
        UsageError: if it is a file, or contains files that this kind of command did not write.
        BadInput: if nothing can be written there.
    """
    check_folder(folder)
    if folder is not None and not force and folder.exists():
        with opened(folder) as place:
            check_opened(place, kind)


def claim_folder(folder: Path | None, kind: str, force: bool = False) -> None:
    """Check the folder as `check_own_folder` does; with `force`, mark it at once so that later checks accept it."""
    check_own_folder(folder, kind, force)
    if force and folder is not None and folder.exists():
        with opened(folder) as place:
            mark(place, kind, files_written(place, kind))


@contextmanager
def own_folder(folder: Path, kind: str) -> Iterator[OpenFolder]:
    """Open a folder to write into, and check that very one; it is created if missing.

    Raises:
        UsageError: if it contains files that this kind of command did not write.
        OSError: if it cannot be created or opened.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with opened(folder) as place:
        check_opened(place, kind)
        yield place


def check_opened(place: OpenFolder, kind: str) -> None:
    """Refuse an open folder that is not `kind`'s own.

    Raises:
        UsageError: if it contains files that this kind of command did not write.
    """
    found = _marked(place)
    if found is not None:
        if found[0] != kind:
            raise UsageError(
                f"{str(place.path)!r} holds the output of {_KINDS[found[0]]}, and {_KINDS[kind]} would mix with it; "
                "choose another --out, or add --force"
            )
    elif not _is_empty(place) and not _RECOGNISE[kind](place):
        raise UsageError(
            f"{str(place.path)!r} holds files that structagent did not write as the output of {_KINDS[kind]}; choose "
            "an empty or a new folder for --out, or add --force, which replaces files of the same names and keeps the "
            "rest"
        )


def mark(place: OpenFolder, kind: str, names: Iterable[str]) -> None:
    """Mark a folder as this tool's own; the given names replace the list of files that it wrote there.

    Raises:
        OSError: if the marker cannot be written.
    """
    content = {"marker_version": _VERSION, "kind": kind, "files": sorted(set(names))}
    place.write({MARKER: json.dumps(content, indent=1) + "\n"})


def files_written(place: OpenFolder, kind: str) -> set[str]:
    """List the names of the files that this tool wrote into a folder as the output of `kind`.

    They are read from the marker, or in a folder of an earlier version from the report of a run. Paths and
    names of anything but a regular file in the folder itself are left out.
    """
    found = _marked(place)
    if found is not None:
        names = found[1] if found[0] == kind else []
    else:
        names = _names_of_earlier_version(place) if kind == "run" else []
    return {name for name in names if _is_plain(name) and place.kind(name) == stat.S_IFREG}


def remove_written(place: OpenFolder, kind: str, keep: Iterable[str] = ()) -> None:
    """Remove the files that `files_written` lists, except those to keep."""
    for name in files_written(place, kind) - set(keep):
        place.remove(name)


def check_subfolder(folder: Path) -> None:
    """Refuse a subfolder of an output folder that is a file or a symbolic link.

    Raises:
        BadInput: for such a subfolder, through which other files would be replaced.
    """
    if os.path.lexists(folder) and not stat.S_ISDIR(folder.lstat().st_mode):
        what = "a symbolic link" if folder.is_symlink() else "a file"
        raise BadInput(f"{str(folder)!r} is {what}, and must be a folder; choose another --out")


def _marked(place: OpenFolder) -> tuple[str, list[Any]] | None:
    """Return the kind and the files that a folder's marker names; `None` if it has no valid marker."""
    found = _json_of(place, MARKER)
    if not isinstance(found, dict) or found.get("marker_version") != _VERSION or found.get("kind") not in [*_KINDS]:
        return None
    files = found.get("files")
    return (found["kind"], files) if isinstance(files, list) else None


def _is_empty(place: OpenFolder) -> bool:
    """Return whether nothing is in a folder but what a process that was killed early leaves there."""
    place.remove_abandoned()
    return all(name == _LOCK and _content_of(place, name, 1) == b"" for name in place.names())


def _is_plain(name: Any) -> bool:
    """Return whether this is a plain file name and not a path."""
    return isinstance(name, str) and name not in ("", ".", "..", MARKER) and "\0" not in name and os.sep not in name


def _content_of(place: OpenFolder, name: str, most: int, of_line: bool = False) -> bytes | None:
    """Return the first `most` bytes of a regular file, or of its first line; `None` for anything else."""
    try:
        with os.fdopen(place.open(name, os.O_RDONLY), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return None
            return file.readline(most) if of_line else file.read(most)
    except OSError:
        return None


def _json_of(place: OpenFolder, name: str) -> Any:
    """Return the content of a small regular JSON file; `None` for anything else."""
    content = _content_of(place, name, _LARGEST_REPORT + 1)
    try:
        return None if content is None or len(content) > _LARGEST_REPORT else json.loads(content)
    except (ValueError, RecursionError):
        return None


def _first_line(place: OpenFolder, name: str) -> Any:
    """Return the JSON value of a regular file's first line; `None` if there is none."""
    content = _content_of(place, name, _LARGEST_REPORT, of_line=True)
    try:
        return None if content is None else json.loads(content)
    except (ValueError, RecursionError):
        return None


# --- folders of earlier versions -----------------------------------------------------------------

_REPORT_KEYS = {"schema_version", "version", "instruction", "options", "outcome", "scene", "verdict", "pictures"}
_SESSION_KEYS = {"schema_version", "version", "started", "options", "machine"}
_RESULT_KEYS = {"id", "line", "fingerprint", "success", "exit_code", "report", "seconds"}
_ABOUT_KEYS = {"version", "code", "library", "networks"}
_SIGNATURES = {".webp": b"RIFF", ".png": b"\x89PNG"}


def _is_report(report: Any) -> bool:
    return isinstance(report, dict) and report.keys() >= _REPORT_KEYS and report["schema_version"] in (1, 2)


def _is_session(line: Any) -> bool:
    return isinstance(line, dict) and line.keys() >= _SESSION_KEYS


def _is_run_folder(place: OpenFolder) -> bool:
    return _is_report(_json_of(place, "report.json")) and (
        place.kind("session.jsonl") is None or _is_session(_first_line(place, "session.jsonl"))
    )


def _is_chat_folder(place: OpenFolder) -> bool:
    return place.kind("report.json") is None and _is_session(_first_line(place, "session.jsonl"))


def _is_batch_folder(place: OpenFolder) -> bool:
    result = _first_line(place, "results.jsonl")
    return isinstance(result, dict) and result.keys() >= _RESULT_KEYS


def _is_evaluation_folder(place: OpenFolder) -> bool:
    about = _json_of(place, "about.json")
    if isinstance(about, dict) and about.keys() >= _ABOUT_KEYS and isinstance(about["networks"], dict):
        return True
    parsing = _json_of(place, "parse.json")
    return isinstance(parsing, dict) and parsing.keys() >= {"schema_version", "version", "evaluations"}


_RECOGNISE: dict[str, Recognise] = {
    "run": _is_run_folder,
    "chat": _is_chat_folder,
    "batch": _is_batch_folder,
    "evaluation": _is_evaluation_folder,
}


def _names_of_earlier_version(place: OpenFolder) -> list[str]:
    """List the files that a run of an earlier version wrote; of the pictures in its report, only those that are
    pictures.
    """
    names = ["session.jsonl"] if _is_session(_first_line(place, "session.jsonl")) else []
    if _begins_with(place, "traceback.txt", b"Traceback (most recent call last)"):
        names.append("traceback.txt")
    report = _json_of(place, "report.json")
    if not _is_report(report) or not isinstance(report["pictures"], list):
        return names
    names += ["report.json", "report.html"]
    for entry in report["pictures"]:
        if isinstance(entry, dict) and _is_plain(entry.get("file")) and _is_picture(place, entry):
            names.append(entry["file"])
    return names


def _is_picture(place: OpenFolder, entry: dict[str, Any]) -> bool:
    """Return whether a file has the name and the first bytes of a picture that a report lists."""
    path = Path(entry["file"])
    signature = _SIGNATURES.get(path.suffix)
    return signature is not None and path.stem == entry.get("name") and _begins_with(place, path.name, signature)


def _begins_with(place: OpenFolder, name: str, signature: bytes) -> bool:
    return _content_of(place, name, len(signature)) == signature
