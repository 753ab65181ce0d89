"""Define the verbs of `structagent models`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import JsonOption, WeightsOption
from agent.errors import NotVerified, UsageError
from agent.rendering.text import columns_of
from agent.runtime.stdio import results_stream
from agent.runtime.terminal_text import console_on
from structdiffusion.planners.registry import LEGAL_NAMES, PLANNERS, USUAL, networks_of

models_app = typer.Typer(rich_markup_mode=None)

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Network.", show_default=False)]


@models_app.callback()
def _models() -> None:
    """List, describe and verify the networks.

    Example: structagent models list
    """


@models_app.command("list")
def list_models(
    weights: WeightsOption = None,
    every: Annotated[
        bool, typer.Option("--all", help="Name all planners: the paper's baselines and the ablations, too.")
    ] = False,
    json_output: JsonOption = False,
) -> None:
    """List the networks and the planners.

    For each network: what it does, its main result, its size and its training steps.

    Example: structagent models list
    """
    from agent.model_cards.card_text import list_rows, list_text, planners_text
    from agent.model_cards.catalogue import networks

    rows = list_rows(networks(weights))
    if json_output:
        print(json.dumps(rows, indent=1))
    else:
        print(list_text(rows, columns_of(sys.stdout)), planners_text(PLANNERS if every else USUAL), sep="\n\n")


@models_app.command("show")
def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Network or planner.", show_default=False)],
    weights: WeightsOption = None,
    json_output: JsonOption = False,
) -> None:
    """Show the model card of a network, or the parts of a planner.

    A card has data, compute, seeds, results, limitations and licence.

    Example: structagent models show diffusion
    """
    from dataclasses import asdict

    from agent.model_cards.card_text import checked_facts, planner_text, shown_text
    from agent.model_cards.catalogue import networks

    there = networks(weights)
    if name in there:
        facts = checked_facts(there[name])
        content, text = facts, shown_text(facts)
    elif name in PLANNERS:
        made = networks_of(name)
        content, text = (
            {"planner": name, "networks": made, "parts": asdict(PLANNERS[name])},
            planner_text(name, tuple(there)),
        )
    else:
        raise UsageError(f"NAME cannot be {name!r}; networks here: {', '.join(there)}; planners: {LEGAL_NAMES}")
    if json_output:
        print(json.dumps(content, indent=1))
    elif sys.stdout.isatty():
        from rich.markdown import Markdown

        console_on(sys.stdout).print(Markdown(text, hyperlinks=False))
    else:
        print(text, end="")


@models_app.command("verify")
def verify(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Network; by default all.", show_default=False)
    ] = None,
    weights: WeightsOption = None,
    json_output: JsonOption = False,
) -> None:
    """Verify networks against their model cards.

    Checksums, config, weights and the output for a synthetic input are checked. The exit code is 7 if a network differs
    from its card, or does not work.

    Example: structagent models verify diffusion
    """
    from dataclasses import asdict

    from agent.model_cards.catalogue import network, networks
    from agent.model_cards.verify import verify as findings_of

    chosen = list(networks(weights).values()) if name is None else [network(name, weights)]
    findings = []
    with results_stream() as results:
        for one in chosen:
            for finding in findings_of(one):
                findings.append(finding)
                if not json_output:
                    said = "ok" if finding.passed else "FAILED"
                    print(f"{finding.name}  {finding.check}: {said}, {finding.detail}", file=results, flush=True)
        if json_output:
            print(json.dumps([asdict(finding) for finding in findings], indent=1), file=results)
    wrong = [finding for finding in findings if not finding.passed]
    if wrong:
        first = wrong[0]
        raise NotVerified(
            f"{len(wrong)} of {len(findings)} checks failed, first the {first.check} of {first.name!r}: {first.detail}"
        )


@models_app.command("card")
def card(
    name: NameArgument,
    run: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder of its training run, with training.json; by default the card keeps its facts."
        ),
    ] = None,
    evaluation: Annotated[
        list[Path] | None,
        typer.Option(
            "--eval",
            metavar="FILE",
            help="Report of an evaluation, eval.json or parse.json; by default the card keeps its results. Repeatable.",
        ),
    ] = None,
    weights: WeightsOption = None,
) -> None:
    """Write the model card of a network.

    The card is written beside the weights, from the records of the training and of the evaluations.

    Example: structagent models card diffusion --run runs/diffusion --eval out/success/eval.json
    """
    from agent.model_cards.card import new_facts
    from agent.model_cards.card_text import checked_text
    from agent.model_cards.catalogue import network

    one = network(name, weights)
    facts = new_facts(one, run, tuple(evaluation or ()))
    text = checked_text(facts, one.facts_path)
    one.facts_path.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    one.text_path.write_text(text, encoding="utf-8")
    print(f"wrote {one.facts_path} and {one.text_path}")
