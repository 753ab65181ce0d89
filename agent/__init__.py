"""Perceive, propose, rank, plan, build and report."""

__version__ = "0.2.0"
