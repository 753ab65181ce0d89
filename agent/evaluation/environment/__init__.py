"""Measure baselines in the environment for learning agents: `structagent evaluate environment`."""
