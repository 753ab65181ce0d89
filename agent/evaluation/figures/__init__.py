"""Measure how often a figure stands that is built from an example or a name: `structagent evaluate figures`."""
