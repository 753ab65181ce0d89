"""Sources of scenes: each module yields a `Scene` and, where there is one, a world to act in."""
