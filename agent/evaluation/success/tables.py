"""Write the tables of a success evaluation in the layout of the paper, as Markdown; each only if its planners were
run.

Cells are percentages with their 95 % Wilson interval; the results of the paper stand below ours, for comparison.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from agent.evaluation.success import paper_results
from structdiffusion.benchmark.success import NO_ARRANGEMENT, Row
from structdiffusion.evaluation_protocol import FAILURE_CLASSES, MAX_PENETRATION
from structdiffusion.planners.registry import PLANNERS, PlannerParts
from structdiffusion.worker_process import WORKER_DIED

Report = Mapping[str, Any]
_ALL = "all"
_CAUSES = (*FAILURE_CLASSES, NO_ARRANGEMENT)
_FULL = ("diffusion", "diffusion-tokens", "geometric")  # whose failures are shown for each structure


@dataclass(frozen=True)
class Table:
    """A table: its title, an explanation, the names of its columns, and its rows."""

    title: str
    about: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self, seeds: str) -> str:
        """Format as Markdown, with a heading and the seed of the scenes."""
        lines = [f"| {' | '.join(line)} |" for line in (self.head, ("---",) * len(self.head), *self.rows)]
        return "\n".join([f"## {self.title}", "", f"{self.about} Seed {seeds}.", "", *lines, ""])


def tables_of(report: Report) -> list[Table]:
    """Return all tables that the planners of a report can fill."""
    found = {evaluation["about"]["model"]: evaluation for evaluation in report["evaluations"]}
    tables = [_success(found), _success_at_k(found), _failures_of_methods(found), _failures_of_structures(found)]
    tables += [*_guidance(found), *_language(found), *_ablations(found), _seconds(found)]
    return tables


def markdown_of(report: Report) -> str:
    """Return the page of all tables, with the command and the seed behind each number."""
    rows = [row for evaluation in report["evaluations"] for row in evaluation["scenes"]]
    seeds = ", ".join(map(str, sorted({row["seed"] for row in rows})))
    scenes = {frozenset((row["structure"], row["number"]) for row in e["scenes"]) for e in report["evaluations"]}
    same = "all planners on the same scenes" if len(scenes) == 1 else "not all planners on all of the scenes: see n"
    intro = (
        f"Percent of the scenes, with 95 % Wilson intervals; {same}. "
        f"Made by structagent {report['version']} with this command:"
    )
    head = ["# Evaluation", "", intro, "", "```sh", report["command"], "```", ""]
    return "\n".join([*head, *(table.markdown(seeds) for table in tables_of(report))])


def changed(parts: PlannerParts, base: PlannerParts) -> dict[str, Any]:
    """Return the fields in which a planner differs from another one, with its own values."""
    names = [field.name for field in fields(PlannerParts)]
    return {name: getattr(parts, name) for name in names if getattr(parts, name) != getattr(base, name)}


def _success(found: Mapping[str, Any]) -> Table:
    structures = _structures(found)
    rows = [
        (name, _n(evaluation), *(_success_in(evaluation, structure) for structure in structures))
        for name, evaluation in found.items()
    ]
    rows += _paper_language(structures)
    about = "The best-ranked arrangement stands as specified. n is the number of scenes of all structures together."
    return Table("Success per method and structure", about, ("model", "n", *structures), tuple(rows))


def _success_at_k(found: Mapping[str, Any]) -> Table:
    top_k = min(evaluation["top_k"] for evaluation in found.values())
    rows = []
    for name, evaluation in found.items():
        rates = evaluation["aggregate"][_ALL]["success_at"]
        rows.append((name, _n(evaluation), *(_cell(rates[str(k)]) for k in range(1, top_k + 1))))
    about = "One of the k best-ranked arrangements stands as specified; all structures."
    head = ("model", "n", *(f"success@{k}" for k in range(1, top_k + 1)))
    return Table("Success within k arrangements", about, head, tuple(rows))


def _failures_of_methods(found: Mapping[str, Any]) -> Table:
    rows, died = [], _died(found)
    for name, evaluation in found.items():
        table = _cell(evaluation["aggregate"][_ALL]["into_table"])
        rows.append((name, _n(evaluation), *_failures(evaluation, _ALL, died), table))
    none = ("-",) * len((*died, "into the table"))
    rows += [
        (*_paper_row(f"paper: {name}", values), *none) for name, values in paper_results.FAILURES_OF_METHODS.items()
    ]
    about = (
        "The first failure of the best-ranked arrangement, in percent of all scenes. The last column is the share of "
        f"scenes in which it intersects the table by more than the allowed {MAX_PENETRATION * 1000:g} mm; it is part "
        "of the intersections."
    )
    return Table("Failure modes per method", about, ("model", "n", *_CAUSES, *died, "into the table"), tuple(rows))


def _failures_of_structures(found: Mapping[str, Any]) -> Table:
    rows, died = [], _died(found)
    for name in [name for name in _FULL if name in found] or list(found):
        rates = found[name]["aggregate"]
        rows += [
            (name, structure, str(rates[structure]["n"]), *_failures(found[name], structure, died))
            for structure in paper_results.STRUCTURES
            if structure in rates
        ]
    for structure, values in paper_results.FAILURES_OF_STRUCTURES.items():
        model, *cells = _paper_row("paper: StructDiffusion", values)
        rows.append((model, structure, *cells, *("-" for _ in died)))
    about = "The first failure of the best-ranked arrangement, in percent of the scenes of each structure."
    return Table("Failure modes per structure", about, ("model", "structure", "n", *_CAUSES, *died), tuple(rows))


def _guidance(found: Mapping[str, Any]) -> Iterator[Table]:
    """Give a table, in the layout of the paper, for each planner that was run with several guidance weights."""
    for base, family in _families(found, "guidance", 0.0):
        weights = {PLANNERS[name].guidance: found[name] for name in family}
        columns = sorted(weights)
        structures = _structures(found)
        rows = [
            (structure, *(_success_in(weights[weight], structure) for weight in columns)) for structure in structures
        ]
        for place, structure in enumerate(paper_results.STRUCTURES):
            known = (
                str(paper_results.GUIDANCE[weight][place]) if weight in paper_results.GUIDANCE else "-"
                for weight in columns
            )
            rows.append((f"paper: {structure}", *known))
        n = " or ".join(sorted({_n(weights[weight]) for weight in columns}))
        about = (
            f"Success of {base} guided by the gradient of the structure discriminator; n = {n} per weight. The paper "
            "guides by a collision classifier and ranks, so that its rows show a trend, not a target."
        )
        yield Table("Classifier guidance", about, ("task", *(f"weight {weight:g}" for weight in columns)), tuple(rows))


def _language(found: Mapping[str, Any]) -> Iterator[Table]:
    """Give a table for each planner that was run on word tokens and on sentences."""
    for base, family in _families(found, "sentence", False):
        structures = _structures(found)
        rows = []
        for name in sorted(family, key=lambda name: PLANNERS[name].sentence):
            label = "sentence" if PLANNERS[name].sentence else "word tokens"
            cells = (_success_in(found[name], structure) for structure in structures)
            rows.append((f"{label} ({name})", _n(found[name]), *cells))
        rows += _paper_language(structures)
        yield Table(f"Language input of {base}", "Success.", ("language", "n", *structures), tuple(rows))


def _ablations(found: Mapping[str, Any]) -> Iterator[Table]:
    """Yield a table for each full planner that was compared with variants of its network, language and guidance."""
    apart = {"network", "sentence", "guidance"}
    for base in [name for name in _FULL if name in found]:
        differing = {name: changed(PLANNERS[name], PLANNERS[base]) for name in found}
        variants = [name for name, parts in differing.items() if parts and not apart & parts.keys()]
        if not variants:
            continue
        structures = _structures(found)
        rows = []
        for name in (base, *variants):
            parts = ", ".join(f"{key.replace('_', ' ')}: {_value(value)}" for key, value in differing[name].items())
            cells = [_success_in(found[name], structure) for structure in structures]
            five = found[name]["aggregate"][_ALL]["success_at"][str(found[name]["top_k"])]
            paired = ("", "", "") if name == base else _paired(found[name]["scenes"], found[base]["scenes"])
            rows.append((name, parts or "-", _n(found[name]), *cells, _cell(five), *paired))
        about = (
            f"Success of {base} and its variants. On the scenes of both: how many only the variant solves, how many "
            "only the full planner solves, and the two-sided exact sign test of these."
        )
        last = f"success@{found[base]['top_k']}"
        head = ("model", "changed", "n", *structures, last, "only variant", "only full", "p")
        yield Table(f"Ablations of {base}", about, head, tuple(rows))


def _seconds(found: Mapping[str, Any]) -> Table:
    rows = []
    for name, evaluation in found.items():
        rates = evaluation["aggregate"][_ALL]
        seconds = [rates["plan_seconds"], rates["plan_seconds_median"]]
        totals = [rates["plan_seconds_total"], rates["seconds_total"]]
        candidates = str(evaluation["about"]["candidates"])
        rows.append((name, _n(evaluation), candidates, *(f"{s:.2f}" for s in seconds), *(f"{s:.0f}" for s in totals)))
    about = "Seconds on one thread: of planning, per scene and in total, and of everything, physics trials included."
    head = ("model", "n", "candidates", "mean", "median", "planning", "everything")
    return Table("Time", about, head, tuple(rows))


def _families(found: Mapping[str, Any], field: str, plain: Any) -> Iterator[tuple[str, list[str]]]:
    """Group the planners of a report that differ only in one field, by the name of the one with the value `plain`."""
    families: dict[PlannerParts, list[str]] = {}
    for name in found:
        families.setdefault(replace(PLANNERS[name], **{field: plain}), []).append(name)
    for parts, family in families.items():
        if len(family) > 1:
            base = next((name for name in family if PLANNERS[name] == parts), family[0])
            yield base, family


def _paired(rows: Sequence[Row], base_rows: Sequence[Row]) -> tuple[str, str, str]:
    """Count the common scenes that only the first solves, and those that only the second solves; add the sign test."""
    from scipy.stats import binomtest

    solved = {(row["structure"], row["number"]): row["success"] for row in base_rows}
    pairs = [(row["success"], solved.get((row["structure"], row["number"]))) for row in rows]
    better, worse = pairs.count((True, False)), pairs.count((False, True))
    p = binomtest(better, better + worse).pvalue if better + worse else 1.0
    return str(better), str(worse), f"{p:.2g}"


def _structures(found: Mapping[str, Any]) -> list[str]:
    """Return the measured structures in the order of the paper, then all."""
    measured = {structure for evaluation in found.values() for structure in evaluation["aggregate"]}
    return [structure for structure in (*paper_results.STRUCTURES, _ALL) if structure in measured]


def _n(evaluation: Mapping[str, Any]) -> str:
    return str(evaluation["aggregate"][_ALL]["n"])


def _success_in(evaluation: Mapping[str, Any], structure: str) -> str:
    rates = evaluation["aggregate"].get(structure)
    return _cell(rates["success"]) if rates else "-"


def _died(found: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the column of scenes whose worker died, if there are any."""
    return (WORKER_DIED,) if any(one["aggregate"][_ALL]["lost"]["count"] for one in found.values()) else ()


def _failures(evaluation: Mapping[str, Any], structure: str, died: Sequence[str]) -> list[str]:
    rates = evaluation["aggregate"][structure]
    return [_cell(rates["failures"][cause]) for cause in _CAUSES] + [_cell(rates["lost"]) for _ in died]


def _paper_row(name: str, values: Sequence[float]) -> tuple[str, ...]:
    return (name, "-", *(f"{value:.1f}" for value in values), "-")


def _paper_language(structures: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the success in the paper by language input, in our columns."""
    rows = list[tuple[str, ...]]()
    for sentence, values in paper_results.LANGUAGE.items():
        of = dict(zip(paper_results.STRUCTURES, map(str, values), strict=True))
        label = "paper: sentence" if sentence else "paper: word tokens"
        rows.append((label, "-", *(of.get(structure, "-") for structure in structures)))
    return rows


def _cell(rate: Mapping[str, Any]) -> str:
    if rate["rate"] is None:
        return "-"
    return f"{100 * rate['rate']:.1f} ({100 * rate['low']:.1f}-{100 * rate['high']:.1f})"


def _value(value: Any) -> str:
    return ("yes" if value else "no") if isinstance(value, bool) else str(value)
