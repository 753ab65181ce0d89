"""Teach, list, show and remove figures: `structagent teach` and the verbs of `structagent structures`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import JsonOption
from agent.errors import BadInput
from agent.runtime.stdio import import_pybullet_silently, results_stream

structures_app = typer.Typer(rich_markup_mode=None)

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Name of a figure.", show_default=False)]


@structures_app.callback()
def _structures() -> None:
    """List, show and remove figures.

    A figure is a structure that is data: a letter T, a heart, a gate. Instructions name it as they name a shape. Those
    that you teach (`structagent teach`) are files beside your configuration file, or in the folder of
    STRUCTAGENT_STRUCTURES.

    Example: structagent structures show heart
    """


@structures_app.command("list")
def list_figures(json_output: JsonOption = False) -> None:
    """List all figures, and how many objects each needs.

    Example: structagent structures list
    """
    from agent.figures.taught import taught_names
    from agent.rendering.text import aligned
    from grounding.figures.names import figure_named, figure_names

    taught = taught_names()
    figures = [figure_named(name) for name in figure_names()]
    with results_stream() as results:
        if json_output:
            rows = [
                {
                    "name": one.name,
                    "nouns": list(one.nouns),
                    "upright": one.stacked,
                    "numbers": list(one.legal),
                    "taught": one.name in taught,
                }
                for one in figures
            ]
            print(json.dumps(rows, indent=1, ensure_ascii=False), file=results)
            return
        lines = [
            (
                one.name,
                "upright" if one.stacked else "flat",
                f"{one.legal_numbers()} objects",
                "taught" if one.name in taught else "",
            )
            for one in figures
        ]
        print(aligned(lines), file=results)


@structures_app.command("show")
def show(name: NameArgument, json_output: JsonOption = False) -> None:
    """Show a figure as characters, with its words, its numbers of objects and its file.

    Example: structagent structures show gate
    """
    from agent.figures.picture import picture
    from agent.figures.taught import figure_said
    from grounding.figures.files import figure_text
    from grounding.figures.names import file_of

    figure = figure_said(name)
    with results_stream() as results:
        if json_output:
            found = {"name": figure.name, "nouns": list(figure.nouns), "numbers": list(figure.legal),
                     "file": str(file_of(figure.name)), "text": figure_text(figure)}  # fmt: skip
            print(json.dumps(found, indent=1, ensure_ascii=False), file=results)
            return
        print("\n".join(picture(figure)), file=results)
        print(f"\n{figure.name}: {figure.legal_numbers()} objects; said as {', '.join(figure.nouns)}", file=results)
        print(f"file: {file_of(figure.name)}", file=results)


@structures_app.command("remove")
def remove(name: NameArgument) -> None:
    """Remove a figure that was taught.

    Example: structagent structures remove "city gate"
    """
    from agent.figures.taught import forget

    print(f"removed {forget(name)}", file=sys.stderr)


def teach(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the figure from now on.", show_default=False)],
    source: Annotated[
        Path,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Example: a scene file, a recording, the folder or session of a run, or a file of a figure.",
            show_default=False,
        ),
    ],
    force: Annotated[bool, typer.Option("--force", help="Replace a taught figure of the same name.")] = False,
) -> None:
    """Teach a figure by an example.

    The structure in the example becomes a figure. Instructions can name it, also with other objects and other numbers.

    Example: structagent teach "city gate" --from out/gate
    """
    import_pybullet_silently()
    from agent.figures.examples import read_example
    from agent.figures.picture import picture
    from agent.figures.taught import checked_name, taught_names
    from agent.figures.taught import teach as keep

    if checked_name(name) in taught_names() and not force:
        raise BadInput(f"{checked_name(name)!r} was taught before; --force replaces it")
    figure, path = keep(name, lambda said: read_example(source, said))
    with results_stream() as results:
        print("\n".join(picture(figure)), file=results)
        print(f"\n{figure.name}: {figure.legal_numbers()} objects\nfile: {path}", file=results)
