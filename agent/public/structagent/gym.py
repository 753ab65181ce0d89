"""Register the environment `structagent/Build-v0`: importing this module is enough.

    import gymnasium
    import structagent.gym

    env = gymnasium.make("structagent/Build-v0")

docs/environment.md describes it.
"""

from __future__ import annotations

from agent.environment.registration import ENVIRONMENT, register_environment
from structagent.errors import public_errors

__all__ = ["ENVIRONMENT"]

with public_errors():
    register_environment()
