"""Show scenes, proposals and results in notebooks as HTML: the report's pictures, without a style of their own."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

from agent.event_base import RecordedEvent
from agent.rendering.image_files import pictures_of, webp_of
from agent.rendering.scene_images import from_above, goal_from_above, goal_overlay
from agent.rendering.text import number
from agent.reporting.html.markup import figure, paragraph, table
from agent.reporting.run_report import RunRecord
from structdiffusion.observation import Arrangement

if TYPE_CHECKING:
    from structagent.evaluations import EvaluationReport
    from structagent.proposals import Proposals
    from structagent.runs import RunResult
    from structagent.scenes import Scene

_SHOWN = 6  # proposals whose scores are listed


def scene_html(scene: Scene) -> str:
    """Return the camera's picture, if there is one, the table from above, and the remarks, as HTML."""
    seen = scene.observation(range(len(scene)))
    camera = None if scene.image is None else figure(webp_of(scene.image), "the scene through the camera")
    return _beside([camera, figure(webp_of(from_above(seen)), "the scene from above")]) + _remarks(scene.notes)


def proposals_html(proposals: Proposals) -> str:
    """Return the best proposal as pictures, and the scores of the best few, as HTML."""
    best, seen = proposals.best, proposals.scene.observation(proposals.moved)
    goal = Arrangement(best.goal_from_initial[list(proposals.moved)])
    over = None
    if seen.color is not None and seen.intrinsics is not None and seen.world_from_camera is not None:
        over = figure(webp_of(goal_overlay(seen, goal)), "the best proposal over the camera picture")
    above = figure(webp_of(goal_from_above(seen, goal)), "the best proposal from above, and the paths to it")
    rows = [
        [str(rank), *(number(score, 3) for score in each.scores.values()), "yes" if each.valid else "no"]
        for rank, each in enumerate(proposals.items[:_SHOWN], start=1)
    ]
    return _beside([over, above]) + table(("rank", *best.scores, "valid"), rows) + _remarks(proposals.notes)


def result_html(result: RunResult) -> str:
    """Return the outcome of a run, its goal and its last picture, and the checks, as HTML."""
    record = RunRecord()
    for payload in result.events:
        record.on_event(RecordedEvent(payload))
    pictures = [figure(each.content, each.caption) for event in result.shown for each in pictures_of(event)]
    rows = [
        ("✓" if check["passed"] else "✗", escape(check["name"]), number(check["measured"], 3), escape(check["limit"]))
        for check in result.checks
    ]
    checks = table(("", "check", "measured", "allowed"), rows) if rows else ""
    outcome = f"<p>{record.turn.outcome} {escape(result.message)}</p>"
    return outcome + _beside(pictures) + checks + _remarks(result.notes)


def evaluation_html(report: EvaluationReport) -> str:
    """Return the rates as an HTML table."""
    rows = [
        [escape(one.model), escape(one.structure), f"{one.successes} of {one.scenes}", f"{one.rate:.1%}",
         f"{one.low:.1%} to {one.high:.1%}"]
        for one in report.rates
    ]  # fmt: skip
    return table(("planner", "structure", "stand", "share", "95 % interval"), rows)


def _beside(figures: Iterable[str | None]) -> str:
    """Place figures next to each other; those that are missing are left out."""
    return f'<div style="display:flex;gap:1em">{"".join(filter(None, figures))}</div>'


def _remarks(notes: Iterable[str]) -> str:
    return "".join(map(paragraph, notes))
