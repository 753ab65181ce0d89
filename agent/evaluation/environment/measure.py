"""Let policies act in the same episodes of the environment, and make the leaderboard."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from agent.environment.policies import PlannerPolicy, Policy, RandomPolicy
from agent.environment.registration import ENVIRONMENT, register_environment
from agent.evaluation.environment.config import RANDOM, EnvironmentConfig, checked_policies
from agent.evaluation.report import REPORT, rate_of, report_frame
from agent.evaluation.result_store import ResultStore, store_folder
from agent.evaluation.rows import LOST, Row, add_rows, lost_count, measured
from agent.pipeline.candidates import check_planner
from agent.pipeline.resources import ResourceCache
from agent.runtime.worker_pool import workforce
from grounding.parsers.embedding import EmbeddingParser
from grounding.spec import SpecError
from structdiffusion.benchmark.success import NO_ARRANGEMENT
from structdiffusion.evaluation_protocol import FAILURE_CLASSES
from structdiffusion.objects.libraries import load_objects
from structdiffusion.parallel import Lost
from structdiffusion.structures.structure import LayoutError

Job = tuple[str, int]  # a policy and the number of an episode


def measure_environment(
    config: EnvironmentConfig,
    policies: Sequence[str] | None,
    episodes: int,
    *,
    workers: int | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """Let each policy act in the same episodes; return a JSON-ready report with the leaderboard, best first.

    Args:
        config: the options on which every row depends.
        policies: "random" and names of planners; `None` for the three baselines.
        episodes: of each policy; episode k begins with the seed of the config plus k.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add policies and episodes. `None` stores nothing.

    Raises:
        UsageError: for an unknown policy, a folder of another evaluation, or without the package gymnasium.
        BadInput: for a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    register_environment()
    names = checked_policies(policies)
    for name in names:
        if name != RANDOM:
            check_planner(name, config.weights, config.allow_unverified)
    fingerprint = config.fingerprint(load_objects(config.objects), names)
    with (
        store_folder(out) as path,
        ResultStore(path, fingerprint, {"policy", "episode"}, (REPORT,)) as store,
        workforce(workers, None) as force,
    ):
        rows = {(row["policy"], row["episode"]): row for row in measured(store.rows)}
        missing = [(name, k) for k in range(episodes) for name in names if (name, k) not in rows]
        results = force.do(_episode, partial(_Loaded, config), (), missing)
        lost = partial(_lost_row, config)
        for row in add_rows(store.add, results, lost, "episodes", len(missing)):
            rows[row["policy"], row["episode"]] = row
    return _report(config, list(rows.values()))


class _Loaded:
    """What a worker keeps between its episodes."""

    def __init__(self, config: EnvironmentConfig) -> None:
        import gymnasium

        register_environment()
        self.config, self._cache, self._policies = config, ResourceCache(), dict[str, Policy]()
        self.environment = gymnasium.make(
            ENVIRONMENT, max_episode_steps=config.actions, objects=config.objects, observation="cloud",
            mode=config.mode, hold=config.hold, structures=config.structures,
        )  # fmt: skip

    @cached_property
    def _parser(self) -> EmbeddingParser:
        return EmbeddingParser.from_pretrained(encoder=self._cache.encoder)

    def policy(self, name: str) -> Policy:
        """Return a policy by its name."""
        import gymnasium

        if name not in self._policies:
            if name == RANDOM:
                actions = self.environment.action_space
                assert isinstance(actions, gymnasium.spaces.Dict)
                self._policies[name] = RandomPolicy(actions)
            else:
                planner = self._cache.planner(name, self.config.weights, self.config.allow_unverified)
                self._policies[name] = PlannerPolicy(planner, self._parser, self.config.candidates)
        return self._policies[name]


def _episode(loaded: _Loaded, job: Job) -> Row:
    """Let a policy act until the end of an episode; return its row."""
    name, number = job
    seed, started = loaded.config.seed + number, time.perf_counter()
    observation, info = loaded.environment.reset(seed=seed)
    row = {
        "policy": name,
        "episode": number,
        "seed": seed,
        "structure": info["structure"],
        "instruction": info["instruction"],
        "objects": info["names"],
    }
    success, detail, count, refused = False, "the policy makes no move", 0, list[str]()
    failure: str | None = NO_ARRANGEMENT
    try:
        policy = loaded.policy(name)
        policy.begin(observation, info, seed)
        while (action := policy.act(observation)) is not None:
            observation, _, ended, truncated, info = loaded.environment.step(action)
            count += 1
            success, failure, detail = info["success"], info["failure"] or None, info["detail"]
            refused += filter(None, [info["refused"]])
            if ended or truncated:
                break
    except (LayoutError, SpecError) as error:
        detail = str(error)
    return {
        **row,
        "success": success,
        "failure": failure,
        "detail": detail,
        "actions": count,
        "refused": refused,
        "seconds": round(time.perf_counter() - started, 2),
    }


def _lost_row(config: EnvironmentConfig, lost: Lost) -> Row:
    name, number = lost.job
    return {"policy": name, "episode": number, "seed": config.seed + number, LOST: lost.reason}


def _report(config: EnvironmentConfig, rows: list[Row]) -> dict[str, Any]:
    """Return the report of all rows."""
    names = checked_policies(list(dict.fromkeys(row["policy"] for row in rows)))
    episodes = 1 + max((row["episode"] for row in rows), default=0)
    rows = sorted(rows, key=lambda row: (names.index(row["policy"]), row["episode"]))
    board = [_rates(name, [row for row in rows if row["policy"] == name]) for name in names]
    board.sort(key=lambda rates: -rates["success"]["rate"])
    return {
        **report_frame(config.command(names, episodes), len(rows), config.seed),
        "environment": ENVIRONMENT,
        "mode": config.mode,
        "leaderboard": board,
        "rows": rows,
    }


def _rates(name: str, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rates of a policy; rows whose worker died count as failed."""
    known = measured(rows)
    shapes = dict.fromkeys(row["structure"] for row in known)
    return {
        "policy": name,
        "n": len(rows),
        "success": rate_of([row.get("success", False) for row in rows]),
        "structures": {
            shape: rate_of([row["success"] for row in known if row["structure"] == shape]) for shape in shapes
        },
        "failures": {
            cause: sum(row["failure"] == cause for row in known) for cause in (*FAILURE_CLASSES, NO_ARRANGEMENT)
        },
        "actions": sum(row["actions"] for row in known) / len(known) if known else None,
        "refused": sum(bool(row["refused"]) for row in known),
        "seconds": sum(row["seconds"] for row in known) / len(known) if known else None,
        "lost": lost_count(rows),
    }
