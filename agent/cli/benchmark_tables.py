"""Write what `structagent benchmark` measures as tables of Markdown, which are read in a terminal as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]


def decision_tables(rows: Sequence[Row]) -> str:
    """Return a table with a line for each decision, and a table of the steps of each; see `measure_decisions`."""
    first = rows[0]
    threads = "1 thread" if first["threads"] == 1 else f"{first['threads']} threads"
    summary = [f"{first['model']}, {first['candidates']} candidates, {threads}; medians of {first['runs']} runs:", ""]
    summary += _head("decision", "seconds", "least to most", "CPU seconds")
    for row in rows:
        spread = f"{row['seconds_min']:.2f} to {row['seconds_max']:.2f}"
        summary.append(f"| {_named(row)} | {row['seconds_median']:.2f} | {spread} | {row['cpu_seconds_median']:.2f} |")
    return "\n\n".join(["\n".join(summary), *map(_steps, rows)])


def _named(row: Row) -> str:
    """Return the structure and its number of objects in words."""
    numbers = sorted({row["objects"][0], row["objects"][-1]})
    return f"{row['structure']}, {' to '.join(map(str, numbers))} objects"


def _steps(row: Row) -> str:
    lines = _head(f"step ({_named(row)})", "seconds", "CPU seconds", "calls")
    for step in row["steps"]:
        lines.append(f"| {step['step']} | {step['seconds']:.3f} | {step['cpu_seconds']:.3f} | {step['calls']:.0f} |")
    return "\n".join(lines)


def sampling_table(rows: Sequence[Row], decision: Row) -> str:
    """Return a table of the released network and ours on the same scene, and of our whole decision.

    Args:
        rows: of `measure_sampling`, as JSON values, the released network first.
        decision: a row of `measure_decisions` about the same structure.
    """
    released, own = rows
    candidates = decision["candidates"]
    whole = decision["seconds_median"] / candidates
    lines = [
        f"{released['structure']} of {released['objects']} objects, {released['samples']} samples; the released "
        "network without its weights (they do not change the time), its candidates computed from single steps:",
        "",
        *_head("network", "seconds per denoising step", "steps", "seconds per candidate"),
    ]
    for row in rows:
        cost = f"{row['seconds_per_step']:.4f} | {row['denoising_steps']} | {row['seconds_per_candidate']:.4f}"
        lines.append(f"| {row['model']} | {cost} |")
    lines += [f"| {own['model']}, the whole decision about {candidates} candidates | | | {whole:.4f} |", ""]
    ratios = [released["seconds_per_candidate"] / seconds for seconds in (own["seconds_per_candidate"], whole)]
    lines.append(f"A candidate of the released network takes {ratios[0]:.0f} times as long as ours to sample, and "
                 f"{ratios[1]:.0f} times as long as ours with everything that the decision does.")  # fmt: skip
    return "\n".join(lines)


def growth_tables(rows: Sequence[Row]) -> str:
    """Return a table for each growth with its exponent; see `growth_json`."""
    tables = []
    for row in rows:
        exponent = "" if row["exponent"] is None else f": CPU seconds grow with exponent {row['exponent']:.2f}"
        lines = [f"{row['size']} ({row['held']}){exponent}", "", *_head(row["size"], "seconds", "CPU seconds", "MB")]
        for size, seconds, cpu, memory in zip(row["sizes"], row["seconds"], row["cpu_seconds"], row["megabytes"]):
            lines.append(f"| {size} | {seconds:.3f} | {cpu:.3f} | {'' if memory is None else f'{memory:.1f}'} |")
        tables.append("\n".join(lines))
    return "\n\n".join(tables)


def _head(first: str, *numbers: str) -> list[str]:
    return [f"| {first} | {' | '.join(numbers)} |", "|---|" + "---:|" * len(numbers)]
