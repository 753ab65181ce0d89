"""Measure how often the planners' proposals stand, on the same scenes: `structagent evaluate success`."""
