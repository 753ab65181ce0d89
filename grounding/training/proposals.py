"""Let the goal network propose goals for labelled texts: the first step of `structagent train verifier`.

The verifier is trained on these (`grounding.training.verifier`), above all on those of texts that the network had not
learnt when it proposed: only they show how it errs on people that it does not know.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grounding.atomic_files import write_whole
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.writer import NetworkWriter
from grounding.goals.goal import Goal
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.network import NetworkProposer
from grounding.propose.resolution import resolved
from grounding.training.goal_corrections import GoalCorrection, goal_corrections, goals_of
from grounding.training.goal_lines import GoalLine, LabelError, goal_lines
from grounding.training.goal_reader import held_out
from grounding.training.steps import Report, silent

WRITTEN = 200  # texts between two writings of the file


@dataclass(frozen=True)
class ProposedGoals:
    """A labelled text and the goals that were proposed for it.

    Attributes:
        scene: name of the scene.
        text: what was said.
        before: the goal so far; without parts for an instruction.
        goal: the labelled goal; `None` where no goal is what was meant.
        goals: the proposed goals, the likeliest first.
        held_out: whether the text is never trained on.
    """

    scene: str
    text: str
    before: Goal
    goal: Goal | None
    goals: tuple[Goal, ...]
    held_out: bool

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {
            "scene": self.scene, "text": self.text, "before": self.before.to_dict(), "held_out": self.held_out,
            "goal": None if self.goal is None else self.goal.to_dict(), "goals": [one.to_dict() for one in self.goals],
        }  # fmt: skip


def read_proposals(path: Path) -> list[ProposedGoals]:
    """Read a file of proposals."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        goal = None if row["goal"] is None else Goal.from_dict(row["goal"])
        goals = tuple(map(Goal.from_dict, row["goals"]))
        before = Goal.from_dict(row["before"])
        found.append(ProposedGoals(row["scene"], row["text"], before, goal, goals, row["held_out"]))
    return found


def write_proposals(
    path: Path,
    network: Path | None = None,
    report: Report = silent,
    rows: Sequence[GoalLine | GoalCorrection] | None = None,
) -> None:
    """Write the proposals for labelled texts, a line of JSON each; a file that is there is completed.

    A text that no goal holds gets goals too, as if one had to be written. Labels that are not legal are left out.

    Args:
        path: file to write, every `WRITTEN` texts.
        network: folder of the goal network; `None` takes the shipped one.
        report: takes a line of progress each time.
        rows: labelled texts; all by default.
    """
    encoder = SentenceEncoder()
    proposer = NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder, *([] if network is None else [network])))
    if rows is None:
        rows = [*goal_lines(), *goal_corrections()]
    legal = []
    for row in rows:
        try:
            before, goal = goals_of(row)
        except LabelError:
            continue
        if goal is None or goal.parts:  # else it only says what stays
            legal.append((row, before, goal))
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    while len(lines) < len(legal):
        some = legal[len(lines) : len(lines) + WRITTEN]
        proposer.ahead((row.text, goal_scenes()[row.scene], before) for row, before, goal in some if goal is not None)
        for row, before, goal in some:
            objects = goal_scenes()[row.scene]
            worded = proposer.propose(row.text, objects, before, answers=goal is not None)
            found = (resolved(one, row.text, objects, encoder).goal for one in worded)
            goals = tuple(dict.fromkeys(one for one in found if one is not None and one.parts))
            lines.append(json.dumps(ProposedGoals(row.scene, row.text, before, goal, goals, held_out(row)).to_dict()))
        write_whole(path, ("\n".join(lines) + "\n").encode())
        report(f"goals proposed for {len(lines)} of {len(legal)} texts")


def main() -> None:
    """Write a file of proposals: `python -m grounding.training.proposals --out FILE`."""
    parser = argparse.ArgumentParser(description="Propose goals for labelled texts.")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="file to write or complete")
    parser.add_argument("--network", type=Path, metavar="DIR", help="folder of the network; by default the shipped one")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only every N-th text")
    given = parser.parse_args()
    rows: list[GoalLine | GoalCorrection] = [*goal_lines(), *goal_corrections()]
    write_proposals(
        given.out, given.network, lambda line: print(line, file=sys.stderr, flush=True), rows[:: given.every]
    )


if __name__ == "__main__":
    main()
