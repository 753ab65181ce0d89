"""Give objects other names in everything that a conversation remembers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any


def renamed(value: Any, names: Mapping[str, str]) -> Any:
    """Return a value with other names of objects in all its texts, also within sentences.

    Texts, dataclasses, mappings, tuples, lists and sets are searched; anything else is returned as it is, and so is
    what names none of the objects. What was one and the same object stays one.

    Args:
        value: what to search.
        names: old name -> new name.
    """
    wanted = re.compile(r"\b(?:" + "|".join(map(re.escape, sorted(names, key=len, reverse=True))) + r")\b")
    known: dict[int, Any] = {}

    def found(one: Any) -> Any:
        if isinstance(one, str):
            return wanted.sub(lambda name: names[name[0]], one)
        if id(one) not in known:
            known[id(one)] = within(one)
        return known[id(one)]

    def within(one: Any) -> Any:
        if isinstance(one, Mapping):
            new: Any = {found(key): found(entry) for key, entry in one.items()}
            same = all(map(_is, (*new, *new.values()), (*one, *one.values())))
        elif type(one) in (tuple, list, set, frozenset):
            entries = [found(entry) for entry in one]
            new, same = type(one)(entries), all(map(_is, entries, one))
        elif is_dataclass(one) and not isinstance(one, type):
            old = {field.name: getattr(one, field.name) for field in fields(one) if field.init}
            changed = {name: found(entry) for name, entry in old.items() if not _is(found(entry), entry)}
            new, same = replace(one, **changed) if changed else one, not changed
        else:
            return one
        return one if same else new

    return found(value)


def _is(one: Any, other: Any) -> bool:
    return one == other if isinstance(one, str) and isinstance(other, str) else one is other
