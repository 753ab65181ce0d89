"""Partly seen objects completed into bodies: what the camera did not see of them, guessed from what it saw."""
