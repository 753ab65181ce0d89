"""The environment of Gymnasium: its own checker, seeds, both vector environments, and what it refuses."""

import warnings

import numpy as np
import pytest

from agent.environment.registration import ENVIRONMENT
from agent.errors import UsageError

gymnasium = pytest.importorskip("gymnasium", reason="the environment needs the package gymnasium")


@pytest.fixture(scope="module", autouse=True)
def registered():
    import structagent.gym

    assert structagent.gym.ENVIRONMENT in gymnasium.registry


@pytest.fixture
def cans():
    """An environment with few objects, which loads at once."""
    env = gymnasium.make(ENVIRONMENT, objects="blocks", structures=("line",))
    yield env
    env.close()


def test_the_checker_of_gymnasium_is_content():
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(ENVIRONMENT, objects="blocks", structures="line", render_mode="rgb_array").unwrapped
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        check_env(env)
    assert not [one for one in told if "symmetric and normalized" not in str(one.message)]


@pytest.mark.parametrize(
    ("observation", "more"),
    [("color", {"color", "segmentation"}), ("depth", {"depth", "segmentation"}), ("cloud", {"clouds"})],
)
def test_observations_are_of_their_space(observation, more):
    env = gymnasium.make(ENVIRONMENT, objects="blocks", structures="line", observation=observation).unwrapped
    seen, _ = env.reset(seed=1)
    env.close()
    assert env.observation_space.contains(seen)
    assert seen.keys() == {"instruction", "objects", "positions"} | more
    here = seen["objects"] > 0
    assert (seen["positions"][here][:, :2] != 0).all() and not seen["positions"][~here].any()
    if observation == "cloud":
        middle = seen["clouds"][here].mean(axis=1)
        assert middle[:, :2] == pytest.approx(seen["positions"][here][:, :2], abs=0.01)
    else:
        assert set(np.unique(seen["segmentation"])) == set(range(here.sum() + 1))


def test_a_seed_gives_the_same_scene(cans):
    first, about = cans.reset(seed=5)
    again, _ = cans.reset(seed=5)
    other, _ = cans.reset(seed=6)
    assert all(np.array_equal(first[key], again[key]) for key in first)
    assert not np.array_equal(first["color"], other["color"])
    assert bytes(first["instruction"]).rstrip(b"\0").decode() == about["instruction"]
    count = len(about["names"])
    assert (first["objects"][:count] > 0).all() and not first["objects"][count:].any()
    assert set(np.unique(first["segmentation"])) == set(range(count + 1))


def test_an_action_is_judged_by_the_protocol_and_an_episode_is_truncated(cans):
    env = gymnasium.make(ENVIRONMENT, objects="blocks", structures="line", max_episode_steps=2)
    observation, _ = env.reset(seed=1)
    stays = {"object": np.int64(0), "pose": np.append(observation["positions"][0], 0.0).astype(np.float32)}
    _, reward, ended, truncated, info = env.step(stays)
    assert (reward, ended, truncated) == (0.0, False, False) and info["failure"] == "semantic"
    assert {"name", "passed", "measured", "limit"} == info["checks"][0].keys() and not info["success"]
    refused = {"object": np.int64(11), "pose": stays["pose"]}
    _, _, ended, truncated, info = env.step(refused)
    assert truncated and not ended and "there is no object 11" in info["refused"]
    env.close()


@pytest.mark.parametrize("kind", ["SyncVectorEnv", "AsyncVectorEnv"])
def test_vector_environments_show_every_instruction(kind):
    make = getattr(gymnasium.vector, kind)
    envs = make([lambda: gymnasium.make("structagent.gym:" + ENVIRONMENT, objects="blocks", structures="line")] * 2)
    try:
        for seed in (3, 8):
            observations, infos = envs.reset(seed=seed)
            told = [bytes(row).rstrip(b"\0").decode() for row in observations["instruction"]]
            assert told == list(infos["instruction"]) and len(told) == 2
        _, rewards, *_, infos = envs.step(envs.action_space.sample())
        assert rewards.shape == (2,) and len(infos["checks"]) == 2
    finally:
        envs.close()


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"mode": "fly"}, "mode cannot be 'fly'; legal: place, arm"),
        ({"observation": "rgb"}, "observation cannot be 'rgb'; legal: color, depth, cloud"),
        ({"structures": ("circle", "blob")}, "a structure cannot be 'blob'"),
        ({"structures": ()}, "a structure cannot be None"),
        ({"hold": "glue"}, "hold cannot be 'glue'; legal: friction, weld"),
    ],
)
def test_an_illegal_argument_is_named(keywords, message):
    with pytest.raises(UsageError, match=message):
        gymnasium.make(ENVIRONMENT, **keywords)


def test_illegal_options_and_actions_are_named(cans):
    env = cans.unwrapped
    with pytest.raises(UsageError, match="the episode is over"):
        env.step(env.action_space.sample())
    with pytest.raises(UsageError, match="the option 'structure' cannot be 'tower'; legal: line"):
        env.reset(seed=0, options={"structure": "tower"})
    env.reset(seed=0)
    with pytest.raises(UsageError, match="an action cannot be"):
        env.step({"object": 0, "pose": np.array((9.0, 0.0, 0.0, 0.0))})
