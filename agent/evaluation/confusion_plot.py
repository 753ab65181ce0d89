"""Plot the confusion matrices of a parser: one panel per slot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def draw_confusion(confusion: Mapping[str, Mapping[str, Mapping[str, int]]], title: str, path: Path) -> None:
    """Write the plot.

    Args:
        confusion: slot -> truth -> answer -> count.
        title: above the panels.
        path: of the PNG file.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.6 * len(confusion), 3.8), layout="tight")
    FigureCanvasAgg(figure)
    figure.suptitle(title, y=1.06)
    for axes, (slot, table) in zip(figure.subplots(1, len(confusion)), confusion.items(), strict=True):
        names = list(table)
        counts = [[table[truth][answer] for answer in names] for truth in names]
        shares = [[count / max(1, sum(row)) for count in row] for row in counts]
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
        for i, row in enumerate(counts):
            for j, count in enumerate(row):
                if count:
                    color = "white" if shares[i][j] > 0.5 else "black"
                    axes.text(j, i, str(count), ha="center", va="center", color=color)
        axes.set_xticks(range(len(names)), names, rotation=45, ha="right")
        axes.set_yticks(range(len(names)), names)
        axes.set_title(slot.replace("_", " "))
        axes.set_xlabel("answer")
        axes.set_ylabel("truth")
    figure.savefig(path, dpi=110, bbox_inches="tight")
