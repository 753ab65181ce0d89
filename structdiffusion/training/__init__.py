"""The training loop, on one device or several, and the record of a run."""
