"""Load YAML from untrusted sources: it is checked before anything is built from it."""

from __future__ import annotations

from typing import Any

from structdiffusion.limits import YAML_LEVELS, YAML_VALUES


def check_yaml(text: str, most_values: int = YAML_VALUES, most_levels: int = YAML_LEVELS) -> None:
    """Refuse YAML with aliases, and YAML that is larger or deeper than any file of its kind.

    An alias (`*name`) repeats a whole part: ten lines of them stand for ten billion values.

    Raises:
        ValueError: for an alias, too many values or levels, or invalid YAML; the message gives the reason and the line.
    """
    import yaml

    values = levels = 0
    try:
        for event in yaml.parse(text, Loader=_loader()):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent):
                raise ValueError(f"line {line} has the alias *{event.anchor}, and aliases are not read")
            values += isinstance(event, (yaml.ScalarEvent, yaml.CollectionStartEvent))
            levels += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if values > most_values or levels > most_levels:
                raise ValueError(f"by line {line} it has more than {most_values} values or {most_levels} levels")
    except (yaml.YAMLError, RecursionError) as error:
        raise ValueError("this is not YAML") from error


def load_yaml(text: str) -> Any:
    """Return the values of a YAML text that `check_yaml` accepts.

    Raises:
        ValueError: as `check_yaml`, or for an invalid value.
    """
    import yaml

    check_yaml(text)
    try:
        return yaml.load(text, Loader=_loader())
    except (yaml.YAMLError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError("this is not YAML") from error


def _loader() -> Any:
    """Return the loader of plain values, in C if available: twenty times as fast."""
    import yaml

    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)
