"""Provide sources of scenes; each module yields a `Scene` and, if available, a world to act in."""
