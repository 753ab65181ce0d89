"""The simulated table top, its depth camera, and partial views."""
