"""Remove secrets from addresses: user name, password and query."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def without_credentials(value: Any, name: str = "") -> Any:
    """Return a copy of a JSON value in which every address (a string whose key ends in "url") is safe to show.

    Args:
        value: the JSON value.
        name: the key under which it was found.
    """
    if isinstance(value, Mapping):
        return {key: without_credentials(entry, key) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [without_credentials(entry, name) for entry in value]
    return _shown(value) if isinstance(value, str) and name.endswith("url") else value


def _shown(address: str) -> str:
    scheme, found, rest = address.partition("://")
    if not found:
        scheme, rest = "", address
    host, slash, path = rest.split("?")[0].split("#")[0].partition("/")
    return scheme + found + host.rpartition("@")[2] + slash + path
