"""The commands of `structagent evaluate`."""
