"""Write model cards and the composition of planners as Markdown, and tables for the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any

from agent.errors import BadInput
from agent.model_cards.card import RECORD, Facts, facts_of, headline
from agent.model_cards.catalogue import FAMILIES, Network, planners_of
from agent.rendering.text import COLUMNS, aligned, duration
from structdiffusion.planners.registry import PLANNERS, networks_of


def card_text(facts: Mapping[str, Any]) -> str:
    """Return the card of a network; about/FAMILY.md describes what its family is suited for and its limits."""
    name, family = facts["name"], facts["family"]
    size = sum(file["bytes"] for file in facts["files"].values())
    parts = [
        f"# {name}: {FAMILIES[family]}",
        f"{facts['parameters']:,} parameters{f', {size / 1e6:.1f} MB' if size else ''}.",
        (files("agent.model_cards") / "about" / f"{family}.md").read_text(encoding="utf-8").strip(),
        "## Training",
        *_training(facts["training"]),
        "## Results",
        *(_results(result) for result in facts["results"]),
    ]
    if not facts["results"]:
        parts.append(f"None written yet; {headline(facts)}.")
    if facts["files"]:
        rows = [[file, f"{about['bytes']:,}", f"`{about['sha256']}`"] for file, about in facts["files"].items()]
        parts += ["## Files", _table(["file", "bytes", "SHA-256"], rows)]
    return "\n\n".join(parts) + "\n"


def checked_text(facts: Mapping[str, Any], path: Path) -> str:
    """Return the card made from untrusted facts.

    Raises:
        BadInput: for facts that cannot make a card; the message names `path`, their source.
    """
    try:
        if not isinstance(facts["name"], str):
            raise TypeError("its name is not text")
        headline(facts)  # of tables
        return card_text(facts)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        reason = f"the key {str(error):.80} is missing" if isinstance(error, KeyError) else "a value has the wrong type"
        raise BadInput(f"{path} is not a record of a model card: {reason}") from error


def checked_facts(network: Network) -> Facts:
    """Return the facts of a network after checking that they can make a card.

    Raises:
        BadInput: as `facts_of` and `checked_text`.
    """
    facts = facts_of(network)
    checked_text(facts, network.facts_path if network.facts_path.is_file() else network.folder / RECORD)
    return facts


def shown_text(facts: Mapping[str, Any]) -> str:
    """Return the card and the list of planners that use the network; that list is no fact of the card and changes
    more often.
    """
    using = planners_of(facts["name"])
    return card_text(facts) + (f"\n## Planners\n\n{', '.join(f'`{name}`' for name in using)}\n" if using else "")


def planner_text(name: str, there: Sequence[str]) -> str:
    """Describe the networks of a planner.

    Args:
        name: the planner's name.
        there: the networks whose weights are available.
    """
    made = networks_of(name)
    rows = [[key.replace("_", " "), _value(value)] for key, value in asdict(PLANNERS[name]).items()]
    lines = [f"- `{one}`{'' if one in there else ': its weights are not there'}" for one in made]
    return "\n\n".join(
        [f"# Planner {name}", "Its networks:" if made else "It has no network.", *(["\n".join(lines)] if made else []),
         _table(["part", "value"], rows)]
    ) + "\n"  # fmt: skip


def list_rows(networks: Mapping[str, Network]) -> list[Facts]:
    """Return a row for each network as JSON values."""
    rows = []
    for network in networks.values():
        facts = checked_facts(network)
        steps = (facts["training"] or {}).get("steps")
        rows.append(
            {
                "name": network.name,
                "family": network.family,
                "what": FAMILIES[network.family],
                "parameters": facts["parameters"],
                "bytes": sum(_size(network.folder / file) for file in network.files),
                "steps": steps if isinstance(steps, int) else None,
                "headline": headline(facts),
                "folder": str(network.folder),
            }
        )
    return rows


def list_text(rows: Sequence[Facts], width: int = COLUMNS) -> str:
    """Return the table of networks as text of at most `width` columns."""
    head = ["name", "what it does", "result", "parameters", "MB", "steps"]
    lines = [
        [row["name"], row["what"], row["headline"], f"{row['parameters']:,}", f"{row['bytes'] / 1e6:.1f}",
         "-" if row["steps"] is None else f"{row['steps']:,}"]
        for row in rows
    ]  # fmt: skip
    return aligned([head, *lines], 3, width)


def planners_text(names: Collection[str]) -> str:
    """List, for each network, those of the named planners that use it, as `--model` takes them."""
    by_network: dict[str, list[str]] = {}
    for name in names:
        by_network.setdefault(PLANNERS[name].network, []).append(name)
    lines = [
        textwrap.fill(f"  {network}: {', '.join(names)}", COLUMNS, subsequent_indent="    ", break_on_hyphens=False)
        for network, names in by_network.items()
    ]
    told = ["planners (--model; `structagent models show NAME` says what one is made of):", *lines]
    if len(names) < len(PLANNERS):
        told.append("  `--all` adds the paper's baselines and the ablations.")
    return "\n".join(told)


def _training(training: Mapping[str, Any] | None) -> list[str]:
    if training is None:
        return ["Nothing is recorded."]
    if "sessions" not in training:
        return [_table(["fact", "value"], [[key.replace("_", " "), _value(value)] for key, value in training.items()])]
    rows = []
    for session in training["sessions"]:
        options, data = session.get("options", {}), session.get("data", {})
        rows.append(
            [
                f"{session['first_step']:,} to {session['last_step']:,}",
                duration(session["seconds"]),
                f"{session.get('devices', 1)} x {session['device']}",
                _value(session.get("batch")) + f" {session.get('examples', 'scenes')}",
                _value(options.get("learning_rate")),
                _value(options.get("seed")),
                _data(data),
                _value(session.get("examples_per_second")),
            ]
        )
    head = ["steps", "time", "devices", "batch, each", "learning rate", "seed", "data", "examples a second"]
    losses = ", ".join(f"{name} {value:.4f}" for name, value in training["losses"].items())
    starts = [start["model.safetensors"]["sha256"] for one in training["sessions"] if (start := one.get("start"))]
    return [
        f"{training['steps']:,} steps in {duration(training['seconds'])}; at the end: {losses}.",
        _table(head, rows),
        *(f"The first weights are those with the SHA-256 `{checksum}`." for checksum in dict.fromkeys(starts)),
    ]


def _data(data: Mapping[str, Any]) -> str:
    if not data:
        return "not recorded"
    rest = {key: value for key, value in data.items() if key not in ("name", "sha256")}
    return f"`{data['name']}`: {_value(rest)}" if rest else f"`{data['name']}`"


def _results(result: Mapping[str, Any]) -> str:
    rows = [
        [row["by"], row["of"], str(row["n"]), _interval(row),
         ", ".join(f"{name} {count}" for name, count in row.get("failures", {}).items())]
        for row in result["rows"]
    ]  # fmt: skip
    what = result["rows"][0]["what"]
    head = ["by", "of", "n", f"{what}, percent (95 % Wilson)", "failures"]
    if not any(row[-1] for row in rows):
        head, rows = head[:-1], [row[:-1] for row in rows]
    return f"`{result['command']}` (structagent {result['version']})\n\n{_table(head, rows)}"


def _interval(rate: Mapping[str, float]) -> str:
    return f"{100 * rate['rate']:.1f} ({100 * rate['low']:.1f}-{100 * rate['high']:.1f})"


def _value(value: Any) -> str:
    if value is None:
        return "not recorded"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_value(one)}" for key, one in value.items())
    return f"{value:,}" if isinstance(value, int) else f"{value:g}" if isinstance(value, float) else str(value)


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
