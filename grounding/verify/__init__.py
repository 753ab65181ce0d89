"""Verify goals: whether they hold all that was said, and whether they can be built."""
