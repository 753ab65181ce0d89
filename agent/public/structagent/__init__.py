"""Propose ranked goal poses for point clouds and a sentence: the Python interface of structagent.

    import structagent

    proposals = structagent.propose(clouds, "put the cups in a small circle on the left", names=names)
    goal_from_initial = proposals.best.goal_from_initial  # (N, 4, 4), one pose for each cloud

Lengths are metres and angles radians, in the world frame: z = 0 is the table top, x points away from the robot, y to
its left. Invalid input raises `StructagentError`, a `ValueError` with a message of one sentence. Nothing heavy is
imported before it is needed. docs/python-api.md describes every array.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from agent import __version__

if TYPE_CHECKING:
    from grounding.goals.goal import Goal
    from grounding.spec import StructureSpec
    from structagent.errors import StructagentError
    from structagent.evaluations import EvaluationReport, SuccessRate, evaluate
    from structagent.instructions import ParsedInstruction, parse
    from structagent.proposals import Proposal, Proposals, propose
    from structagent.runs import RunResult, run
    from structagent.scenes import Scene
    from structagent.sources import load_scene
    from structdiffusion.observation import Table

_HOME = {
    "EvaluationReport": "structagent.evaluations",
    "Goal": "grounding.goals.goal",
    "ParsedInstruction": "structagent.instructions",
    "Proposal": "structagent.proposals",
    "Proposals": "structagent.proposals",
    "RunResult": "structagent.runs",
    "Scene": "structagent.scenes",
    "StructagentError": "structagent.errors",
    "StructureSpec": "grounding.spec",
    "SuccessRate": "structagent.evaluations",
    "Table": "structdiffusion.observation",
    "evaluate": "structagent.evaluations",
    "load_scene": "structagent.sources",
    "parse": "structagent.instructions",
    "propose": "structagent.proposals",
    "run": "structagent.runs",
}

__all__ = [
    "EvaluationReport",
    "Goal",
    "ParsedInstruction",
    "Proposal",
    "Proposals",
    "RunResult",
    "Scene",
    "StructagentError",
    "StructureSpec",
    "SuccessRate",
    "Table",
    "__version__",
    "evaluate",
    "load_scene",
    "parse",
    "propose",
    "run",
]


def __getattr__(name: str) -> Any:
    """Import a public name on its first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'structagent' has no attribute {name!r}; it has: {', '.join(__all__)}")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
