"""Figures: structures that are data, not code, such as a letter T, a heart or a gate."""
