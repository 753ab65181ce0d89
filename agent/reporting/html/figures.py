"""Draw the table from above as SVG: the same objects, colours and letters as in the terminal.

Every object has its own colour; distractors are pale, with a dashed outline.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from agent.rendering.object_markers import Marker, markers_of_candidate, markers_of_scene, stack_sentence, stacks
from agent.rendering.palette import ink_on
from agent.rendering.text import number
from agent.rendering.text import place as where
from agent.reporting.event_text import shortcoming

CANDIDATES_SHOWN = 6
_MARGIN = 0.03  # m around the table
_ROBOT = 45  # mm: the radius of the mark that says where the robot is
_MILLIMETRES = 1000
_LETTER = 34  # mm


def legend(scene: Mapping[str, Any]) -> str:
    """List which letter is which object, as HTML; `scene` is a report's."""
    entries = "".join(
        f"<li>{swatch(marker)}{escape(marker.label)}</li>"
        for marker in sorted(markers_of_scene(scene), key=lambda marker: (marker.faint, marker.letter))
    )
    return f'<ul class="legend">{entries}</ul>'


def swatch(marker: Marker) -> str:
    """Draw an object's letter on its colour."""
    kind = "key faint" if marker.faint else "key"
    look = f"background:rgb{marker.color};color:rgb{ink_on(marker.color)}"
    return f'<span class="{kind}" style="{look}">{escape(marker.letter)}</span>'


def candidates(report: Mapping[str, Any]) -> str:
    """Draw the best candidates of a report side by side, with their scores and why they are not the best."""
    scene, ranked = report["scene"], report["proposals"]["candidates"]
    chosen = report["chosen"]["rank"] if report["chosen"] else None
    shown = [each for each in ranked if each["rank"] <= CANDIDATES_SHOWN or each["rank"] == chosen]
    figures = []
    for candidate in shown:
        markers = markers_of_candidate(scene, candidate["positions"], candidate.get("turns") or ())
        rank, total = candidate["rank"], number(candidate["scores"].get("total"), 3)
        why = "the best" if rank == 1 else shortcoming(candidate["scores"], ranked[0]["scores"])
        picked = rank == chosen
        figures.append(
            f'<figure class="{"candidate chosen" if picked else "candidate"}">'
            + _drawing(markers, scene["table"], f"candidate {rank} from above: {_places(scene, candidate)}")
            + f"<figcaption><b>{rank}</b> · score {total}{' · <b>chosen</b>' if picked else ''}"
            + f"<br>{escape(why)}{_stacks(markers)}</figcaption></figure>"
        )
    return f'<div class="candidates">{"".join(figures)}</div>'


def _stacks(markers: Sequence[Marker]) -> str:
    """Draw the stacks among the objects from the side and in words, because from above only their tops are visible."""
    out = []
    for stack in stacks(markers):
        level_of: dict[str, int] = {}
        rows: list[str] = []
        for marker in stack:
            level = level_of[marker.label] = level_of.get(marker.below, -1) + 1
            rows += [""] * (level == len(rows))
            rows[level] += swatch(marker)
        levels = "".join(f"<span>{row}</span>" for row in reversed(rows))
        words = escape(stack_sentence(stack))
        out.append(f'<span class="stacked"><span class="stack">{levels}</span>stacked: {words}</span>')
    return "".join(out)


def tried(report: Mapping[str, Any]) -> str:
    """Draw the final places of the objects after a trial without the arm, from above."""
    markers = markers_of_candidate(report["scene"], report["tried"]["positions"], report["tried"]["turns"])
    words = f"what was tried from above: {_places(report['scene'], report['tried'])}"
    return (
        '<figure class="candidate">'
        + _drawing(markers, report["scene"]["table"], words)
        + f"<figcaption>where the released objects came to rest, from above{_stacks(markers)}</figcaption></figure>"
    )


def _places(scene: Mapping[str, Any], arrangement: Mapping[str, Any]) -> str:
    """List the places of the participants as a text alternative to the drawing."""
    part = [seen["name"] for seen in scene["objects"] if seen["takes_part"]]
    return "; ".join(f"{name} {where(position)}" for name, position in zip(part, arrangement["positions"], strict=True))


def _drawing(markers: Sequence[Marker], table: Sequence[float], words: str) -> str:
    """Draw the table and the objects on it, in millimetres: up is away from the robot, left is +y."""
    x_min, x_max, y_min, y_max = table

    def place(x: float, y: float) -> tuple[int, int]:
        return round((y_max + _MARGIN - y) * _MILLIMETRES), round((x_max + _MARGIN - x) * _MILLIMETRES)

    width, height = place(x_min - _MARGIN, y_min - _MARGIN)
    height += _ROBOT
    left, top = place(x_max, y_max)
    right, bottom = place(x_min, y_min)
    shapes = [f'<rect class="wood" x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" rx="6"/>']
    middle = place(x_min, 0.0)[0]
    # Its base is farther off than the picture reaches.
    robot = f"M{middle - _ROBOT} {bottom + _ROBOT + 15} a{_ROBOT} {_ROBOT} 0 0 1 {2 * _ROBOT} 0z"
    shapes.append(f'<path class="robot" d="{robot}"/>')
    for marker in markers:
        corners = " ".join(f"{column},{row}" for column, row in (place(x, y) for x, y in marker.outline))
        kind = "object faint" if marker.faint else "object"
        shapes.append(f'<polygon class="{kind}" points="{corners}" style="--color:rgb{marker.color}"/>')
    near_edge: dict[str, float] = {}  # of what stands on an object: x
    for marker in markers:
        edge = float(marker.outline[:, 0].min())
        near_edge[marker.below] = min(edge, near_edge.get(marker.below, edge))
    taken: list[tuple[int, int]] = []
    for marker in reversed(markers):
        x, y = marker.outline.mean(axis=0)
        if marker.label in near_edge:  # its letter stands where it is seen; otherwise the caption alone has it
            seen = (near_edge[marker.label] - marker.outline[:, 0].min()) * _MILLIMETRES
            if seen < _LETTER:
                continue
            x = marker.outline[:, 0].min() + seen / 2 / _MILLIMETRES
        column, row = place(x, y)
        while any(abs(column - other) < _LETTER and abs(row - line) < _LETTER for other, line in taken):
            row += _LETTER // 2
        taken.append((column, row))
        shapes.append(f'<text x="{column}" y="{row}" dy=".35em">{escape(marker.letter)}</text>')
    return f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(words)}">{"".join(shapes)}</svg>'
