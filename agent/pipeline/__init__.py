"""Carry out one instruction from its text to the built structure, step by step."""
