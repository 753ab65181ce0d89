"""Implement the verbs of `structagent evaluate`, one module each, and what they share."""
