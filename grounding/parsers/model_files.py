"""Find or fetch model folders that a user names, and check them before a library loads them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grounding.untrusted_files import JSON_BYTES, check_weights, read_json

if TYPE_CHECKING:
    from torch import nn

_CONFIGS = ("config.json", "generation_config.json")
# Bytes of a tokenizer or of an index of weights: the largest vocabularies, of 260,000 tokens, take 35 MB.
TOKENIZER_BYTES = 100_000_000
WEIGHTS_BYTES = 2**44
# The most layers and experts that a config may ask for: several times as many as any model has.
_MOST = {re.compile("layer", re.IGNORECASE): 1000, re.compile("expert", re.IGNORECASE): 10_000}
# Weights may be packed as 4 bits each, and some be computed from others.
_WEIGHTS_A_BYTE = 8


class ModelFilesError(ValueError):
    """Files of a model that must not be loaded; the message is the reason, without the folder."""


def fetch(name: str) -> Path:
    """Fetch a model of the Hugging Face hub, or find it in the local cache where it is already there.

    Raises:
        ModelFilesError: where the hub cannot give it.
    """
    from huggingface_hub import snapshot_download
    from huggingface_hub.utils import disable_progress_bars

    disable_progress_bars()
    try:
        return Path(snapshot_download(name, allow_patterns=["*.json", "*.safetensors"]))
    except Exception as error:  # the hub's client raises many kinds: offline, not found, not allowed
        raise ModelFilesError(
            f"there is no folder {name!r} and the model hub could not give it: {first_line(error)}"
        ) from error


def names_code(folder: Path) -> bool:
    """Tell whether a model's `config.json` names Python code in its folder, which a known architecture does without.

    Raises:
        ModelFilesError: for a config that cannot be read, or that has attention computed by a program from the hub.
    """
    config = _config(folder)
    # The library fetches an attention that is called OWNER/NAME from the hub and runs it, wherever it is asked for.
    for part in _parts(config):
        for key in ("attn_implementation", "_attn_implementation", "_attn_implementation_internal"):
            if "/" in json.dumps(part.get(key)):
                raise ModelFilesError(f"{key} in config.json asks for a program from the model hub, which is never run")
    return bool(config.get("auto_map"))


def first_line(error: Exception) -> str:
    """Return the first line of an error's message, or its kind where it has none."""
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__


def check_files(folder: Path) -> None:
    """Check the size of a model's files, and how many parts its config asks for, before a library reads them.

    Raises:
        ModelFilesError: for files that are no files of a model, or would take a library minutes and gigabytes.
    """
    for part in _parts(_config(folder)):
        for named, most in _MOST.items():
            for key, value in part.items():
                if named.search(key) and isinstance(value, (int, float)) and value > most:
                    raise ModelFilesError(f"{key[:60]} in config.json is {value:.6g}; at most {most} are made")
    for path in sorted(folder.glob("*.json")):
        size, most = path.stat().st_size, JSON_BYTES if path.name in _CONFIGS else TOKENIZER_BYTES
        if not path.is_file() or size > most:
            what = f"has {size} bytes; at most {most} are read" if path.is_file() else "is not a file"
            raise ModelFilesError(f"{path.name} {what}")
    for path in _weights(folder):
        try:
            check_weights(path, WEIGHTS_BYTES)
        except (OSError, ValueError) as error:
            raise ModelFilesError(f"{path.name} cannot be read: {first_line(error)}") from error


def check_promise(folder: Path, network: nn.Module) -> None:
    """Check that a model's files hold about as many weights as its network, made without memory, has.

    A library makes up what is missing: a small folder would take all memory.

    Raises:
        ModelFilesError: for a network that is many times larger than its files.
    """
    stored = sum(path.stat().st_size for path in _weights(folder))
    wanted = sum(each.numel() for each in (*network.parameters(), *network.buffers()))
    if wanted > _WEIGHTS_A_BYTE * stored:
        raise ModelFilesError(f"config.json asks for {wanted} weights, and the files have only {stored} bytes of them")


def _config(folder: Path) -> dict[str, Any]:
    path = folder / "config.json"
    try:
        found = read_json(path)
    except OSError as error:
        raise ModelFilesError(f"{path.name} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ModelFilesError(f"{path.name} is not JSON text") from error
    if not isinstance(found, dict):
        raise ModelFilesError(f"{path.name} holds no JSON object")
    return found


def _weights(folder: Path) -> list[Path]:
    """Return the files of weights that a library reads: one, or those that an index names.

    Raises:
        ModelFilesError: for an index that is none, or names something else than files of its folder.
    """
    whole, index = folder / "model.safetensors", folder / "model.safetensors.index.json"
    if whole.exists() or not index.exists():
        return [whole] if whole.exists() else []
    try:
        names = {Path(name) for name in read_json(index, TOKENIZER_BYTES)["weight_map"].values()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise ModelFilesError(f"{index.name} is not a list of weight files") from error
    if any(name.name != str(name) for name in names):
        raise ModelFilesError(f"{index.name} names a file outside its folder")
    return sorted(folder / name for name in names)


def _parts(config: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a config and all objects in it."""
    waiting: list[Any] = [config]
    while waiting:
        part = waiting.pop()
        waiting += part.values() if isinstance(part, dict) else part if isinstance(part, list) else []
        if isinstance(part, dict):
            yield part
