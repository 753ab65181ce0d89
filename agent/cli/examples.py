"""The options that name an example, "the same" of an instruction: --like and --exact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.errors import UsageError

LikeOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Example that instructions refer to as “the same”: a scene file, a recording, the folder or session of a "
        "run or a chat, or a file of a figure.",
    ),
]
ExactOption = Annotated[
    bool,
    typer.Option("--exact", help="Copy the places of the example to 5 mm, levels and turns included: 2 to 12 objects."),
]


def check_example(like: Path | None, exact: bool, parser: str) -> None:
    """Raise a `UsageError` for options that go with no example."""
    if exact and like is None:
        raise UsageError("--exact needs an example; name it with --like FILE")
    if like is not None and parser == "llm":
        raise UsageError("--like works only without a language model; leave out --parser llm")
