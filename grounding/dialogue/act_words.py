"""Load the words of small talk and of questions in a conversation, and how these are worded (`acts.toml`)."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

_TABLES = tomllib.loads((Path(__file__).parent / "acts.toml").read_text(encoding="utf-8"))
COLORS: tuple[str, ...] = tuple(_TABLES["colors"].split())
NO_THING = frozenset(_TABLES["no_thing"].split())
SUPERLATIVES: Mapping[str, tuple[str, bool]] = {
    word: (by, most) for word, (by, most) in _TABLES["superlatives"].items()
}
COMPARATIVES: Mapping[str, str] = _TABLES["comparatives"]
RELATIONS_SAID: Mapping[str, str] = _TABLES["relations"]
REGIONS: Mapping[str, str] = _TABLES["regions"]


def _joined(texts: Mapping[str, str]) -> dict[str, str]:
    """Join the lines that end with a backslash with the next one."""
    return {name: re.sub(r"\\\n\s*", "", text) for name, text in texts.items()}


PARTS: Mapping[str, str] = _joined(_TABLES["parts"]) | {
    "REL": "(right |directly |immediately |standing |lying |sitting )*"
    f"(?P<relation>{'|'.join(sorted(RELATIONS_SAID, key=len, reverse=True))})",
    "COMPARATIVE": f"<VALUE:{'|'.join(COMPARATIVES)}>",
    "SUPERLATIVE": f"<VALUE:{'|'.join(SUPERLATIVES)}>",
    "COLOR": f"({'|'.join(COLORS)})",
}
WORDINGS: Mapping[str, str] = _joined(_TABLES["wordings"])
