"""Plot a success evaluation: success over the number of arrangements tried, and failures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.evaluation_protocol import FAILURE_CLASSES
from structdiffusion.worker_process import WORKER_DIED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CAUSES = (*FAILURE_CLASSES, NO_ARRANGEMENT, WORKER_DIED)
_COLOR_OF = dict(zip(_CAUSES, ("#c44e52", "#dd8452", "#8172b3", "#4c72b0", "#8c8c8c", "#1f1f21"), strict=True))
_MARKERS = "osD^vP*X"


def draw_success_at_k(report: Mapping[str, Any], path: Path) -> None:
    """Plot success@k of every planner over all scenes; with the 95 % intervals for up to six planners."""
    evaluations = report["evaluations"]
    figure = _figure(8.5, max(4.5, 0.24 * len(evaluations)))
    axes = figure.subplots()
    for place, evaluation in enumerate(evaluations):
        every = evaluation["aggregate"]["all"]
        ks = range(1, evaluation["top_k"] + 1)
        rates = [every["success_at"][str(k)] for k in ks]
        line, = axes.plot(
            ks, [100 * rate["rate"] for rate in rates], marker=_MARKERS[place // 10 % len(_MARKERS)],
            label=f"{evaluation['about']['model']} (n = {every['n']})",
        )  # fmt: skip
        if len(evaluations) <= 6:
            low, high = ([100 * rate[end] for rate in rates] for end in ("low", "high"))
            axes.fill_between(ks, low, high, color=line.get_color(), alpha=0.12, linewidth=0)
    axes.set_xticks(range(1, max(evaluation["top_k"] for evaluation in evaluations) + 1))
    axes.set_xlabel("arrangements tried, best-ranked first")
    axes.set_ylabel("scenes solved, percent")
    axes.grid(alpha=0.3)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
    figure.savefig(path, dpi=120, bbox_inches="tight")


def draw_failures(report: Mapping[str, Any], path: Path) -> None:
    """Plot what fails first in the best-ranked arrangements: a bar per planner, over all scenes and per structure."""
    evaluations = list(reversed(report["evaluations"]))  # the first on top
    names = [evaluation["about"]["model"] for evaluation in evaluations]
    panels = ["all"] + [s for s in dict.fromkeys(s for e in evaluations for s in e["aggregate"]) if s != "all"]
    figure = _figure(3.0 + 2.6 * len(panels), 1.6 + 0.3 * len(names))
    grid = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)
    for axes, structure in zip(grid[0], panels, strict=True):
        rates = [evaluation["aggregate"].get(structure) for evaluation in evaluations]
        left = [0.0] * len(names)
        for cause, color in _COLOR_OF.items():
            if cause == WORKER_DIED and not any(_rate(one["aggregate"]["all"], cause) for one in evaluations):
                continue
            widths = [100 * _rate(found, cause) for found in rates]
            axes.barh(names, widths, left=left, color=color, label=cause)
            left = [sum(pair) for pair in zip(left, widths, strict=True)]
        counts = sorted({found["n"] for found in rates if found})
        axes.set_title(f"{structure} (n = {', '.join(map(str, counts))})", fontsize=10)
        axes.set_xlabel("percent of scenes")
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.grid(axis="x", alpha=0.3)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
    figure.savefig(path, dpi=120, bbox_inches="tight")


def _rate(rates: Mapping[str, Any] | None, cause: str) -> float:
    """Return the share of scenes that failed for a cause; 0 if none was measured."""
    if rates is None:
        return 0.0
    return rates["lost"]["rate"] if cause == WORKER_DIED else rates["failures"][cause]["rate"]


def _figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="tight")
    FigureCanvasAgg(figure)
    return figure
