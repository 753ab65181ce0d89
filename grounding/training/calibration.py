"""Fit the probability that a judged goal is what was meant: the last step of `structagent train verifier`.

A logistic regression on the few numbers of `grounding.decide.features`, on texts that no network was trained on:
labelled ones that are held back, and the development sets. Every second of them is left out: on these the result is
reported.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np

from grounding.atomic_files import write_whole
from grounding.benchmark import Row, development_rows, five_slots, is_exact, load_rows
from grounding.decide import Circumstances, features
from grounding.goal_benchmark.rows import GoalRow, goal_scenes, load_goal_rows
from grounding.goal_benchmark.scoring import compare_with_row
from grounding.goal_network.writer import NetworkWriter
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.parse_result import Parse
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.propose.network import NetworkProposer
from grounding.propose.proposal import Proposal
from grounding.propose.resolution import resolved
from grounding.resolve.attributes import SceneObject
from grounding.spec import StructureSpec
from grounding.training.goal_corrections import GoalCorrection, goal_corrections, goals_of
from grounding.training.goal_lines import GoalLine, LabelError, goal_lines
from grounding.training.goal_reader import held_out
from grounding.verify.verifier import FOLLOW_UP, INSTRUCTION, WEIGHTS, Verifier

REPORTED_EVERY = 2
OF_DEVELOPMENT = 4.0  # weight of a text of the development sets: they are few, and nearer to what people say most
WITHOUT_SCENE = 0.3  # of a labelled instruction that is read without its scene: it was written for what stands there
_DEVELOPMENT = ("development", "development_b", "development_c", "development_llm")
_RIDGE = 1.0
_STEPS = 50  # of Newton's method, which needs about ten


@dataclass(frozen=True)
class JudgedText:
    """A text with what says whether a goal is what was meant.

    Attributes:
        text: what was said.
        objects: of the scene; `None` where none is known.
        before: the goal so far.
        is_meant: whether a proposal is what was meant.
        weight: of the text.
    """

    text: str
    objects: Sequence[SceneObject] | None
    before: Goal
    is_meant: Callable[[Proposal], bool]
    weight: float = 1.0


def texts(encoder: SentenceEncoder) -> Iterator[JudgedText]:
    """Yield all texts; labelled instructions also as if nobody knew what is there."""
    rows: list[GoalLine | GoalCorrection] = [*goal_lines(), *goal_corrections()]
    for row in filter(held_out, rows):
        objects = goal_scenes()[row.scene]
        try:
            before, goal = goals_of(row)
        except LabelError:
            continue

        def is_labelled(one: Proposal, goal: Goal | None = goal, count: int = len(objects)) -> bool:
            return goal is not None and one.goal is not None and compare_goals(one.goal, goal, count).exact

        def is_labelled_in_scene(
            one: Proposal,
            is_meant: Callable[[Proposal], bool] = is_labelled,
            text: str = row.text,
            there: Sequence[SceneObject] = objects,
        ) -> bool:
            return one.worded is not None and is_meant(resolved(one.worded, text, there, encoder))

        yield JudgedText(row.text, objects, before, is_labelled)
        if isinstance(row, GoalLine):
            yield JudgedText(row.text, None, before, is_labelled_in_scene, WITHOUT_SCENE)
    folder = resources.files("grounding") / "benchmark_data"
    for name in _DEVELOPMENT:
        for one in load_goal_rows(str(folder / f"goals_{name}.jsonl")):
            there = None if one.scene is None else goal_scenes()[one.scene]
            yield JudgedText(one.text, there, Goal(), partial(_is_row, one), OF_DEVELOPMENT)
    for slots in (*development_rows(), *load_rows(str(folder / "development_b.jsonl"))):
        yield JudgedText(slots.text, None, Goal(), partial(_has_slots, slots), OF_DEVELOPMENT)


def _is_row(row: GoalRow, one: Proposal) -> bool:
    return bool(row.goals) and one.goal is not None and compare_with_row(one.goal, row)[0].exact


def _has_slots(row: Row, one: Proposal) -> bool:
    return one.goal is not None and is_exact(row, five_slots(Parse(row.text, StructureSpec(), ""), "ok", one.goal))


def fitted(rows: np.ndarray, right: np.ndarray, weight: np.ndarray | None = None) -> np.ndarray:
    """Fit the weights of a logistic regression with a small ridge: (F,) float64.

    Args:
        rows: (N, F) float64 features.
        right: (N,) float64, 1 where the goal is what was meant.
        weight: (N,) float64 of each row; `None` for the same.
    """
    share_of = np.ones(len(rows)) if weight is None else weight
    weights = np.zeros(rows.shape[1])
    for _ in range(_STEPS):
        shares = 1.0 / (1.0 + np.exp(-rows @ weights))
        slope = rows.T @ (share_of * (shares - right)) + _RIDGE * weights
        curve = (rows * (share_of * shares * (1.0 - shares))[:, None]).T @ rows + _RIDGE * np.eye(len(weights))
        weights -= np.linalg.solve(curve, slope)
    return weights


def judged(rows: Sequence[JudgedText], interpreter: Interpreter) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the features of all candidates of texts, (N, F), whether each is what was meant, (N,), and their weights,
    (N,).
    """
    found, right, weight = list[list[float]](), list[float](), list[float]()
    interpreter.read_ahead((row.text, row.objects, row.before) for row in rows)
    for row in rows:
        candidates, proposals = interpreter.candidates(row.text, row.objects, row.before)
        nothing = sum(each.certainty for each in proposals if each.answer)
        known = Circumstances(nothing, row.objects is not None)
        for number, one in enumerate(candidates):
            found.append(features(candidates, number, known))
            right.append(float(row.is_meant(one.proposal)))
            weight.append(row.weight)
    return np.array(found), np.array(right), np.array(weight)


def calibrate(folder: Path = WEIGHTS, network: Path | None = None) -> dict[str, float]:
    """Fit the weights of a verifier's probability, and write them into its `config.json`.

    Args:
        folder: of the verifier.
        network: folder of the goal network that proposes; `None` takes the shipped one.

    Returns:
        How many candidates were "fitted" and "reported", and the "log_loss" of the latter, which were left out.
    """
    encoder, proposing = SentenceEncoder(), [] if network is None else [network]
    interpreter = Interpreter(
        lambda: EmbeddingParser.from_pretrained(encoder=encoder), encoder,
        NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder, *proposing)),
        lambda: Verifier.from_pretrained(encoder, folder),
    )  # fmt: skip
    counts, total, weights = {"fitted": 0, "reported": 0}, 0.0, dict[str, list[float]]()
    for kind, rows in _by_kind(texts(encoder)).items():
        kept = [row for place, row in enumerate(rows) if place % REPORTED_EVERY]
        found, right, weight = judged(kept, interpreter)
        fit = fitted(found, right, weight)
        left_rows, left_right, _ = judged(rows[::REPORTED_EVERY], interpreter)
        shares = np.clip(1.0 / (1.0 + np.exp(-left_rows @ fit)), 1e-6, 1.0 - 1e-6)
        total -= np.sum(left_right * np.log(shares) + (1.0 - left_right) * np.log(1.0 - shares))
        weights[kind] = [round(float(each), 4) for each in fit]
        counts = {"fitted": counts["fitted"] + len(found), "reported": counts["reported"] + len(left_rows)}
    config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    config["weights"] = weights
    write_whole(folder / "config.json", (json.dumps(config, indent=1) + "\n").encode())
    return {**counts, "log_loss": round(float(total / counts["reported"]), 4)}


def _by_kind(rows: Iterable[JudgedText]) -> dict[str, list[JudgedText]]:
    """Divide texts into instructions and what is said of a goal: few features mean the same in both."""
    found: dict[str, list[JudgedText]] = {INSTRUCTION: [], FOLLOW_UP: []}
    for row in rows:
        found[FOLLOW_UP if row.before.parts else INSTRUCTION].append(row)
    return found


def main() -> None:
    """Fit a verifier's probability: `python -m grounding.training.calibration --verifier DIR`."""
    parser = argparse.ArgumentParser(description="Fit the probability of judged goals.")
    parser.add_argument("--verifier", type=Path, default=WEIGHTS, metavar="DIR", help="folder of the verifier")
    print(json.dumps(calibrate(parser.parse_args().verifier)))


if __name__ == "__main__":
    main()
