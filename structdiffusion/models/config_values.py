"""Check that the values in a checkpoint's config have legal types and ranges: the file may come from an untrusted
source.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any


def checked_values(config: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Check the values of a config, and return them with lists as tuples, because JSON has no tuples.

    Args:
        config: a dataclass in which every field has a default, which determines the legal type.
        values: field -> value, from JSON.

    Raises:
        ValueError: for a value of another type, a number that is not finite, a size below 1 or a scale that is not
            above 0; the message names the field, the value and what is legal.
    """
    defaults = {field.name: field.default for field in fields(config)}
    return {name: _checked(name, value, defaults[name]) for name, value in values.items()}


def _checked(name: str, value: Any, default: Any) -> Any:
    if default is MISSING:
        return value
    if isinstance(default, int):
        legal = "a whole number of at least 1"
        right = type(value) is int and value >= 1
    elif isinstance(default, str):
        legal = "a text"
        right = isinstance(value, str)
    elif isinstance(default[0], str):
        legal = "a list of texts"
        right = isinstance(value, list | tuple) and all(isinstance(each, str) for each in value)
    else:
        positive = name.endswith("_scale")
        legal = f"a list of {len(default)} finite numbers" + (" above 0" if positive else "")
        right = isinstance(value, list | tuple) and len(value) == len(default)
        right = right and all(_is_number(each) and (each > 0 or not positive) for each in value)
    if not right:
        given = repr(value)
        given = given if len(given) <= 60 else f"{given[:57]}..."
        raise ValueError(f"{name} cannot be {given}; legal: {legal}")
    return tuple(value) if isinstance(value, list) else value


def _is_number(value: Any) -> bool:
    """Return whether it is a number that float32, in which networks compute, can hold."""
    return type(value) in (int, float) and -1e30 < value < 1e30
