"""Measure what comes of what is said while the arm builds: `structagent evaluate steering`."""
