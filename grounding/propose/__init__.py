"""Propose goals of what was said: the goal network, in the text's own words."""
