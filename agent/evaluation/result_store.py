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
from types import ModuleType
from typing import Any

import structdiffusion
from agent import __version__
from agent.errors import BadInput, UsageError
from agent.runtime.atomic_files import write_whole
from agent.runtime.jsonl_journal import Journal, locked
from agent.runtime.output_ownership import check_own_folder, mark
from structdiffusion.benchmark.success import Row
from structdiffusion.limits import ABOUT_BYTES, read_at_most
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.factory import WEIGHTS
from structdiffusion.planners.registry import networks_of

ABOUT, ROWS = "about.json", "rows.jsonl"


class KeptRows:
    """What is known, for one evaluation at a time. Close it, or use it as a context manager.

    Args:
        path: of the folder, made where it is not there.
        asked: the `fingerprint` of what decides the rows; its networks may become more from command to command.
        keys: what every row has.
        files: others that will be written there.

    Attributes:
        path: of the folder.
        rows: in the order in which they came.

    Raises:
        UsageError: when the folder is a file, another evaluation is at work in it, what it holds was asked for
            otherwise, or this tool did not write it.
        BadInput: when it holds something else.
    """

    def __init__(self, path: Path, asked: Mapping[str, Any], keys: set[str], files: Sequence[str]) -> None:
        self.path = path
        check_own_folder(path, "evaluation")
        self._lock = locked(path, "evaluation")
        try:
            mark(path, "evaluation", (ABOUT, ROWS, *files))
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
                kept = json.loads(read_at_most(path, ABOUT_BYTES))
                networks = dict(kept["networks"])
                differing = next((key for key in asked if key != "networks" and kept[key] != asked[key]), None)
            except (ValueError, KeyError, TypeError, RecursionError) as error:
                raise BadInput(f"{str(path)!r} is not that of an evaluation; choose another --out") from error
            if differing is not None:
                raise self._refusal(_difference(differing, kept[differing], asked[differing]))
            for name, checksum in asked["networks"].items():
                if networks.get(name, checksum) != checksum:
                    raise self._refusal(f"with other weights of the network {name!r}, which have changed since")
        elif (self.path / ROWS).exists():
            raise BadInput(f"{str(self.path)!r} has {ROWS} but no {ABOUT}; choose another --out")
        merged = dict(asked) | {"networks": networks | asked["networks"]}
        write_whole(path, json.dumps(merged, indent=1) + "\n")

    def _refusal(self, why: str) -> UsageError:
        return UsageError(f"{str(self.path)!r} holds an evaluation {why}; choose another --out")


def _difference(key: str, kept: Any, asked: Any) -> str:
    if key == "version":
        return f"by structagent {kept}, and this is {asked}"
    if key == "code":
        return "by other code, and rows of both may not mix"
    if key == "evaluation":
        return f"of {kept}, and not of {asked}"
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


def fingerprint(
    options: Mapping[str, Any],
    library: Sequence[ObjectModel],
    models: Sequence[str],
    weights: Path | None,
    packages: Sequence[ModuleType] = (),
) -> dict[str, Any]:
    """What two commands have in common whose rows may stand in one table, as `KeptRows` takes it, JSON-ready.

    "code", "library" and "networks" are SHA-256 checksums: of this project's way from a goal to a verdict, of the
    objects, and of every network of these models.

    Args:
        options: those of the command that decide its rows.
        library: the objects.
        models: names of planners.
        weights: the folder of checkpoints, or `None` for those shipped.
        packages: whose code decides the rows too, beside `structdiffusion`.
    """
    networks = sorted({network for model in models for network in networks_of(model)})
    return {
        "version": __version__,
        "code": _checksum_of_code(structdiffusion, *packages),
        **options,
        "library": _checksum_of_objects(library),
        "networks": _checksums_of_networks(weights or WEIGHTS, networks),
    }


def _checksum_of_code(*packages: ModuleType) -> str:
    checksum = hashlib.sha256()
    for package in packages:
        folder = Path(package.__file__ or "").parent
        for path in sorted(folder.rglob("*.py")):
            checksum.update(f"{path.relative_to(folder)} {path.stat().st_size}\n".encode() + path.read_bytes())
    return checksum.hexdigest()


def _checksum_of_objects(library: Sequence[ObjectModel]) -> str:
    checksum = hashlib.sha256()
    for model in library:
        checksum.update(repr((model.name, model.category, model.mass, model.friction)).encode())
        for part in model.hulls:
            checksum.update(part.tobytes())
    return checksum.hexdigest()


def _checksums_of_networks(folder: Path, networks: Sequence[str]) -> dict[str, str]:
    checksums = {}
    for name in networks:
        with (folder / name / "model.safetensors").open("rb") as file:
            checksums[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return checksums
