"""Store the rows of an evaluation in a folder as they arrive; the same command resumes one that was stopped.

| file | content |
|---|---|
| `about.json` | the inputs of the rows; a command with different ones is refused |
| `rows.jsonl` | the rows, appended as they come |
"""

from __future__ import annotations

import hashlib
import json
import stat
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import structdiffusion
from agent import __version__
from agent.errors import BadInput, UsageError
from agent.runtime.jsonl_journal import Journal, locked_folder
from agent.runtime.output_ownership import check_opened, check_own_folder, mark
from structdiffusion.benchmark.success import Row
from structdiffusion.limits import ABOUT_BYTES, read_at_most
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.factory import WEIGHTS
from structdiffusion.planners.registry import networks_of

ABOUT, ROWS = "about.json", "rows.jsonl"
ROW_FORMAT = 3  # version of the rows' keys; rows of another version cannot be resumed
_ABSENT = object()


class ResultStore:
    """The stored rows of one evaluation. Close it, or use it as a context manager.

    Args:
        path: the path of the folder, created if missing.
        config: the `fingerprint` of the rows; later commands may add networks to it.
        keys: the keys that every row has.
        files: the names of other files that will be written there.

    Attributes:
        path: the path of the folder.
        rows: the rows in the order in which they were added.
        place: the folder, open.

    Raises:
        UsageError: if the folder is a file, is in use by another evaluation, contains rows of another configuration, or
            was not written by structagent.
        BadInput: if its files are not those of an evaluation.
    """

    def __init__(self, path: Path, config: Mapping[str, Any], keys: set[str], files: Sequence[str]) -> None:
        self.path = path
        check_own_folder(path, "evaluation")
        with ExitStack() as until_open:
            self.place = until_open.enter_context(locked_folder(path, "evaluation"))
            check_opened(self.place, "evaluation")
            mark(self.place, "evaluation", (ABOUT, ROWS, *files))
            # Before there is anything to be written to that file.
            for name in (ABOUT, ROWS, *files):
                if self.place.kind(name) == stat.S_IFDIR:
                    raise BadInput(f"{str(path / name)!r} is a folder, and must be a file; choose another --out")
            self._check_config(config)
            self._journal = Journal(self.place, ROWS, keys, "row of an evaluation")
            until_open.callback(self._journal.close)
            self._open = until_open.pop_all()

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def rows(self) -> Sequence[Row]:
        return self._journal.entries

    def add(self, row: Row) -> None:
        """Store a row."""
        self._journal.add(row)

    def close(self) -> None:
        """Release the folder."""
        self._open.close()

    def _check_config(self, config: Mapping[str, Any]) -> None:
        """Compare the configuration with the stored one, and store it."""
        path = self.path / ABOUT
        networks: dict[str, str] = {}
        if path.exists():
            try:
                stored = json.loads(read_at_most(path, ABOUT_BYTES))
                networks = dict(stored["networks"])
                keys = [key for key in config if key != "networks"]
                differing = next((key for key in keys if stored.get(key, _ABSENT) != config[key]), None)
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
                raise BadInput(f"{str(path)!r} is not that of an evaluation; choose another --out") from error
            if differing is not None:
                raise self._refusal(_difference(differing, stored.get(differing), config[differing]))
            for name, checksum in config["networks"].items():
                if networks.get(name, checksum) != checksum:
                    raise self._refusal(f"with other weights of the network {name!r}, which have changed since")
        elif (self.path / ROWS).exists():
            raise BadInput(f"{str(self.path)!r} has {ROWS} but no {ABOUT}; choose another --out")
        merged = dict(config) | {"networks": networks | config["networks"]}
        self.place.write({ABOUT: json.dumps(merged, indent=1) + "\n"})

    def _refusal(self, reason: str) -> UsageError:
        return UsageError(f"{str(self.path)!r} holds an evaluation {reason}; choose another --out")


def _difference(key: str, stored: Any, wanted: Any) -> str:
    """Describe how a stored evaluation differs from the wanted one."""
    if key == "row_format":
        return "whose rows have an older format and cannot be resumed"
    if key == "version":
        return f"by structagent {stored}, but this is {wanted}"
    if key == "code":
        return "by other code, and rows of both cannot be mixed"
    if key == "evaluation":
        return f"of {stored}, and not of {wanted}"
    if key == "library":
        return "with other objects of that name, which have changed since"
    return f"{_option(key, stored)}, not {_option(key, wanted)}"


def _option(key: str, value: Any) -> str:
    option = "--" + key.replace("_", "-")
    if value is None or value is False:
        return f"without {option}"
    return f"with {option}" if value is True else f"with {option} {value}"


@contextmanager
def store_folder(out: Path | None) -> Iterator[Path]:
    """Yield the folder of `--out`, or a temporary one if there is none."""
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
    """Return the inputs that two commands must share for their rows to be compared, JSON-ready.

    "code", "library" and "networks" are SHA-256 checksums: of the code between a goal and its verdict, of the objects,
    and of every network of these planners.

    Args:
        options: options of the command that decide its rows.
        library: the objects.
        models: names of planners.
        weights: folder of the checkpoints; `None` for the shipped ones.
        packages: other packages besides `structdiffusion` whose code affects the rows.
    """
    networks = sorted({network for model in models for network in networks_of(model)})
    return {
        "row_format": ROW_FORMAT,
        "version": __version__,
        "code": checksum_of_code(*packages),
        **options,
        "library": _checksum_of_objects(library),
        "networks": _checksums_of_networks(weights or WEIGHTS, networks),
    }


def checksum_of_code(*packages: ModuleType) -> str:
    """Return the SHA-256 checksum of the code of `structdiffusion` and of these packages."""
    checksum = hashlib.sha256()
    for package in (structdiffusion, *packages):
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
