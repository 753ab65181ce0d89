"""A folder that keeps the rows of an evaluation as they come: the same command goes on where it was stopped.

| file | content |
|---|---|
| `about.json` | what decides the rows; a command with anything else is refused |
| `rows.jsonl` | the rows, appended as they come |
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import structdiffusion
from agent.errors import BadInput, UsageError
from agent.journal import Journal, locked
from structdiffusion.evaluation import Row
from structdiffusion.objects.model import ObjectModel
from structdiffusion.sampling import WEIGHTS

ABOUT, ROWS = "about.json", "rows.jsonl"


class KeptRows:
    """What is known, for one evaluation at a time. Close it, or use it as a context manager.

    Args:
        path: of the folder, made where it is not there.
        asked: what decides the rows, JSON-ready: the options by their names, "version", "code", "library", and
            "networks", whose checksums may become more from command to command.
        keys: what every row has.
        files: others that will be written there.

    Attributes:
        path: of the folder.
        rows: in the order in which they came.

    Raises:
        UsageError: when the folder is a file, another evaluation is at work in it, or what it holds was asked for
            otherwise.
        BadInput: when it holds something else.
    """

    def __init__(self, path: Path, asked: Mapping[str, Any], keys: set[str], files: Sequence[str]) -> None:
        self.path = path
        self._lock = locked(path, "evaluation")
        try:
            # Before there is anything to be written to that file.
            for name in (ABOUT, ROWS, *files):
                if (path / name).is_dir():
                    raise BadInput(f"{str(path / name)!r} is a folder, and must be a file; choose another --out")
            self._agree(asked)
            self._journal = Journal(path / ROWS, keys, "row of an evaluation")
        except BaseException:
            os.close(self._lock)
            raise

    def __enter__(self) -> KeptRows:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def rows(self) -> Sequence[Row]:
        return self._journal.entries

    def add(self, row: Row) -> None:
        """Keeps a row."""
        self._journal.add(row)

    def close(self) -> None:
        """Lets other evaluations into the folder."""
        self._journal.close()
        os.close(self._lock)

    def _agree(self, asked: Mapping[str, Any]) -> None:
        """Compares what is asked with what the folder was made for, and keeps it."""
        path = self.path / ABOUT
        networks: dict[str, str] = {}
        if path.exists():
            try:
                kept = json.loads(path.read_text(encoding="utf-8"))
                networks = dict(kept["networks"])
                differing = next((key for key in asked if key != "networks" and kept[key] != asked[key]), None)
            except (ValueError, KeyError, TypeError) as error:
                raise BadInput(f"{str(path)!r} is not that of an evaluation; choose another --out") from error
            if differing is not None:
                raise self._refusal(_difference(differing, kept[differing], asked[differing]))
            for name, checksum in asked["networks"].items():
                if networks.get(name, checksum) != checksum:
                    raise self._refusal(f"with other weights of the network {name!r}, which have changed since")
        elif (self.path / ROWS).exists():
            raise BadInput(f"{str(self.path)!r} has {ROWS} but no {ABOUT}; choose another --out")
        merged = dict(asked) | {"networks": networks | asked["networks"]}
        new = path.with_name(f".{ABOUT}")
        new.write_text(json.dumps(merged, indent=1) + "\n", encoding="utf-8")
        new.replace(path)

    def _refusal(self, why: str) -> UsageError:
        return UsageError(f"{str(self.path)!r} holds an evaluation {why}; choose another --out")


def _difference(key: str, kept: Any, asked: Any) -> str:
    if key == "version":
        return f"by structagent {kept}, and this is {asked}"
    if key == "code":
        return "by other code, and rows of both may not mix"
    if key == "library":
        return "with other objects of that name, which have changed since"
    return f"{_said(key, kept)}, not {_said(key, asked)}"


def _said(key: str, value: Any) -> str:
    option = "--" + key.replace("_", "-")
    if value is None or value is False:
        return f"without {option}"
    return f"with {option}" if value is True else f"with {option} {value}"


@contextmanager
def kept_folder(out: Path | None) -> Iterator[Path]:
    """What `--out` names, or where it names nothing a folder that ends with the evaluation."""
    if out is not None:
        yield out
    else:
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)


def checksum_of_code() -> str:
    """SHA-256 of this project's way from a goal to a verdict."""
    checksum = hashlib.sha256()
    folder = Path(structdiffusion.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        checksum.update(f"{path.relative_to(folder)} {path.stat().st_size}\n".encode() + path.read_bytes())
    return checksum.hexdigest()


def checksum_of_objects(library: Sequence[ObjectModel]) -> str:
    """SHA-256 of an object library."""
    checksum = hashlib.sha256()
    for model in library:
        checksum.update(repr((model.name, model.category, model.mass, model.friction)).encode())
        for part in model.hulls:
            checksum.update(part.tobytes())
    return checksum.hexdigest()


def checksums_of_networks(folder: Path | None, networks: Sequence[str]) -> dict[str, str]:
    """SHA-256 of the weights of each network in a folder of checkpoints, by default those shipped."""
    checksums = {}
    for name in networks:
        with ((folder or WEIGHTS) / name / "model.safetensors").open("rb") as file:
            checksums[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return checksums
