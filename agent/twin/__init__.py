"""A simulated twin of a recorded scene: partly seen objects completed into bodies, and the arm as it stood."""
