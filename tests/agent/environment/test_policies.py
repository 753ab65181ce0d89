"""The baselines: random moves, and a planner that is built move by move."""

import numpy as np
import pytest

from structdiffusion.planners.geometric import GeometricPlanner

gymnasium = pytest.importorskip("gymnasium", reason="the environment needs the package gymnasium")


@pytest.fixture(scope="module")
def env():
    from agent.environment.build_env import BuildEnv

    env = BuildEnv(observation="cloud", structures=("line", "tower"))
    yield env
    env.close()


def test_random_moves_are_of_objects_that_take_part(env):
    from agent.environment.build_env import TAKES_PART
    from agent.environment.policies import RandomPolicy

    observation, info = env.reset(seed=2)
    policy = RandomPolicy(env.action_space)
    policy.begin(observation, info, 4)
    actions = [policy.act(observation) for _ in range(30)]
    assert all(env.action_space.contains(action) for action in actions)
    assert {int(action["object"]) for action in actions} == set(np.flatnonzero(observation["objects"] == TAKES_PART))


@pytest.mark.parametrize("shape", ["line", "tower"])
def test_a_planner_builds_what_the_instruction_asks_for(env, shape):
    from agent.environment.policies import PlannerPolicy
    from grounding.parsers.embedding import EmbeddingParser

    policy = PlannerPolicy(GeometricPlanner(), EmbeddingParser.from_pretrained(), 16)
    observation, info = env.reset(seed=1, options={"structure": shape})
    policy.begin(observation, info, 1)
    ended = False
    while not ended:
        observation, reward, ended, _, info = env.step(policy.act(observation))
    assert reward == 1.0 and info["success"], info["detail"]
    assert policy.act(observation) is None
