"""Define the commands of `structagent evaluate`."""
