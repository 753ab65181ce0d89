"""Compose arrangements in which all parts of a goal hold together, from the camera's observation."""
