"""Track which output folders and files this tool wrote, so that nothing else is replaced or deleted.

A folder that a command writes into gets a marker, `.structagent.json`:

    {"marker_version": 1, "kind": "run", "files": ["report.html", "report.json", "scene-before.webp"]}

A command takes a folder that is missing, empty, or marked with its own kind. Folders of earlier versions, which have no
marker, are recognised by their report, results or session. `--force` takes any other folder; foreign files
then stay, unless they have the name of a file that is written. Only files that the marker lists are deleted, and only
in the folder itself: no paths, no symbolic links, no folders.
"""

from __future__ import annotations

import contextlib
import json
import os
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError
from agent.runtime.atomic_files import write_whole
from agent.runtime.output_paths import check_folder

MARKER = ".structagent.json"
_LOCK = ".lock"  # may stay behind in a folder in which nothing else was written
_VERSION = 1
_KINDS = {"run": "a run", "chat": "a chat", "batch": "a batch", "evaluation": "an evaluation"}
_LARGEST_REPORT = 64 * 2**20  # bytes; a larger file is no report of a run

Recognise = Callable[[Path], bool]


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
            OSError: if it cannot be written.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        mark(self.folder, self.kind, files_written(self.folder, self.kind) | {name})
        write_whole(self.folder / name, content)
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
    if folder is None or force or not folder.exists():
        return
    found = _marked(folder)
    if found is not None:
        if found[0] != kind:
            raise UsageError(
                f"{str(folder)!r} holds the output of {_KINDS[found[0]]}, and {_KINDS[kind]} would mix with it; "
                "choose another --out, or add --force"
            )
    elif not _is_empty(folder) and not _RECOGNISE[kind](folder):
        raise UsageError(
            f"{str(folder)!r} holds files that structagent did not write as the output of {_KINDS[kind]}; choose an "
            "empty or a new folder for --out, or add --force, which replaces files of the same names and keeps the rest"
        )


def claim_folder(folder: Path | None, kind: str, force: bool = False) -> None:
    """Check the folder as `check_own_folder` does; with `force`, mark it at once so that later checks accept it."""
    check_own_folder(folder, kind, force)
    if force and folder is not None:
        mark(folder, kind, files_written(folder, kind))


def mark(folder: Path, kind: str, names: Iterable[str]) -> None:
    """Mark a folder as this tool's own; the given names replace the list of files that it wrote there.

    Raises:
        OSError: if the marker cannot be written.
    """
    content = {"marker_version": _VERSION, "kind": kind, "files": sorted(set(names))}
    write_whole(folder / MARKER, json.dumps(content, indent=1) + "\n")


def files_written(folder: Path, kind: str) -> set[str]:
    """List the names of the files that this tool wrote into a folder as the output of `kind`.

    They are read from the marker, or in a folder of an earlier version from the report of a run. Paths and
    names of anything but a regular file in the folder itself are left out.
    """
    found = _marked(folder)
    if found is not None:
        names = found[1] if found[0] == kind else []
    else:
        names = _names_of_earlier_version(folder) if kind == "run" else []
    return {name for name in names if _is_plain(name) and _is_regular(folder / name)}


def remove_written(folder: Path, kind: str, keep: Iterable[str] = ()) -> None:
    """Remove the files that `files_written` lists, except those to keep."""
    for name in files_written(folder, kind) - set(keep):
        with contextlib.suppress(OSError):
            (folder / name).unlink()


def check_subfolder(folder: Path) -> None:
    """Refuse a subfolder of an output folder that is a file or a symbolic link.

    Raises:
        BadInput: for such a subfolder, through which other files would be replaced.
    """
    if os.path.lexists(folder) and not stat.S_ISDIR(folder.lstat().st_mode):
        what = "a symbolic link" if folder.is_symlink() else "a file"
        raise BadInput(f"{str(folder)!r} is {what}, and must be a folder; choose another --out")


def _marked(folder: Path) -> tuple[str, list[Any]] | None:
    """Return the kind and the files that a folder's marker names; `None` if it has no valid marker."""
    found = _json_of(folder / MARKER)
    if not isinstance(found, dict) or found.get("marker_version") != _VERSION or found.get("kind") not in [*_KINDS]:
        return None
    files = found.get("files")
    return (found["kind"], files) if isinstance(files, list) else None


def _is_empty(folder: Path) -> bool:
    return all(
        entry.name == _LOCK and entry.is_file(follow_symlinks=False) and entry.stat().st_size == 0
        for entry in os.scandir(folder)
    )


def _is_plain(name: Any) -> bool:
    """Return whether this is a plain file name and not a path."""
    return isinstance(name, str) and name not in ("", ".", "..", MARKER) and "\0" not in name and os.sep not in name


def _is_regular(path: Path) -> bool:
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def _json_of(path: Path) -> Any:
    """Return the content of a small regular JSON file; `None` for anything else."""
    try:
        if not _is_regular(path) or path.stat().st_size > _LARGEST_REPORT:
            return None
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None


def _first_line(path: Path) -> Any:
    """Return the JSON value of a regular file's first line; `None` if there is none."""
    try:
        if not _is_regular(path):
            return None
        with path.open("rb") as file:
            return json.loads(file.readline(_LARGEST_REPORT))
    except (OSError, ValueError, RecursionError):
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


def _is_run_folder(folder: Path) -> bool:
    session = folder / "session.jsonl"
    return _is_report(_json_of(folder / "report.json")) and (
        not os.path.lexists(session) or _is_session(_first_line(session))
    )


def _is_chat_folder(folder: Path) -> bool:
    return not (folder / "report.json").exists() and _is_session(_first_line(folder / "session.jsonl"))


def _is_batch_folder(folder: Path) -> bool:
    result = _first_line(folder / "results.jsonl")
    return isinstance(result, dict) and result.keys() >= _RESULT_KEYS


def _is_evaluation_folder(folder: Path) -> bool:
    about = _json_of(folder / "about.json")
    if isinstance(about, dict) and about.keys() >= _ABOUT_KEYS and isinstance(about["networks"], dict):
        return True
    parsing = _json_of(folder / "parse.json")
    return isinstance(parsing, dict) and parsing.keys() >= {"schema_version", "version", "evaluations"}


_RECOGNISE: dict[str, Recognise] = {
    "run": _is_run_folder,
    "chat": _is_chat_folder,
    "batch": _is_batch_folder,
    "evaluation": _is_evaluation_folder,
}


def _names_of_earlier_version(folder: Path) -> list[str]:
    """List the files that a run of an earlier version wrote; of the pictures in its report, only those that are
    pictures.
    """
    names = ["session.jsonl"] if _is_session(_first_line(folder / "session.jsonl")) else []
    if _begins_with(folder / "traceback.txt", b"Traceback (most recent call last)"):
        names.append("traceback.txt")
    report = _json_of(folder / "report.json")
    if not _is_report(report) or not isinstance(report["pictures"], list):
        return names
    names += ["report.json", "report.html"]
    for entry in report["pictures"]:
        if isinstance(entry, dict) and _is_plain(entry.get("file")) and _is_picture(folder / entry["file"], entry):
            names.append(entry["file"])
    return names


def _is_picture(path: Path, entry: dict[str, Any]) -> bool:
    """Return whether a file has the name and the first bytes of a picture that a report lists."""
    signature = _SIGNATURES.get(path.suffix)
    return signature is not None and path.stem == entry.get("name") and _begins_with(path, signature)


def _begins_with(path: Path, signature: bytes) -> bool:
    if not _is_regular(path):
        return False
    with path.open("rb") as file:
        return file.read(len(signature)) == signature
