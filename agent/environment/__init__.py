"""Offer building as an environment for learning agents; an episode is a scene of the benchmark."""
