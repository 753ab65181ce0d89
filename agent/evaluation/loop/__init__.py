"""Measure what a build does when somebody disturbs it: `structagent evaluate loop`."""
