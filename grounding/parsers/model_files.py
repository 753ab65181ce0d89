"""Find or fetch model folders that a user names, and check them before a library loads them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


class ModelFilesError(ValueError):
    """Files of a model that must not be loaded; the message is the reason, without the folder."""


def fetch(name: str, patterns: tuple[str, ...] = ("*.json", "*.safetensors")) -> Path:
    """Fetch a model of the Hugging Face hub, or find it in the local cache where it is already there.

    Raises:
        ModelFilesError: where the hub cannot give it.
    """
    from huggingface_hub import snapshot_download
    from huggingface_hub.utils import disable_progress_bars

    disable_progress_bars()
    try:
        return Path(snapshot_download(name, allow_patterns=list(patterns)))
    except Exception as error:  # the hub's client raises many kinds: offline, not found, not allowed
        raise ModelFilesError(
            f"there is no folder {name!r} and the model hub could not give it: {first_line(error)}"
        ) from error


def names_code(folder: Path) -> bool:
    """Tell whether a model's `config.json` names Python code in its folder, which a known architecture does without.

    Raises:
        ModelFilesError: for a config that cannot be read, or that has attention computed by a program from the hub.
    """
    config = _json_object(folder / "config.json")
    # The library fetches an attention that is called OWNER/NAME from the hub and runs it, wherever it is asked for.
    parts: list[Any] = [config]
    while parts:
        part = parts.pop()
        parts += part.values() if isinstance(part, dict) else part if isinstance(part, list) else []
        for key in ("attn_implementation", "_attn_implementation", "_attn_implementation_internal"):
            if isinstance(part, dict) and "/" in json.dumps(part.get(key)):
                raise ModelFilesError(f"{key} in config.json asks for a program from the model hub, which is never run")
    return bool(config.get("auto_map"))


def first_line(error: Exception) -> str:
    """Return the first line of an error's message, or its kind where it has none."""
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__


def _json_object(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ModelFilesError(f"{path.name} is no JSON text") from error
    if not isinstance(found, dict):
        raise ModelFilesError(f"{path.name} holds no JSON object")
    return found
