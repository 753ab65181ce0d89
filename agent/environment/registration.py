"""Register the environment with Gymnasium, where that is installed."""

from __future__ import annotations

from agent.errors import UsageError

ENVIRONMENT = "structagent/Build-v0"
MOST_ACTIONS = 20  # after which an episode is truncated


def register_environment() -> None:
    """Register `ENVIRONMENT`, once.

    Raises:
        UsageError: without the package gymnasium.
    """
    try:
        from gymnasium.envs.registration import register, registry
    except ImportError as error:
        message = "the environment needs the package gymnasium: pip install 'structagent[gym]'"
        raise UsageError(message) from error
    from structdiffusion.simulation.pybullet_import import import_pybullet_silently

    import_pybullet_silently()
    if ENVIRONMENT not in registry:
        register(ENVIRONMENT, "agent.environment.build_env:BuildEnv", max_episode_steps=MOST_ACTIONS)
