"""Benchmarks of planners: success rate in physics, and planning time."""
