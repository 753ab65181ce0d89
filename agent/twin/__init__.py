"""The way back from a simulated twin of a recorded scene to the arm."""
