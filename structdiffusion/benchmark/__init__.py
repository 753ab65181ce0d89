"""Measurements: how often arrangements stand, and how long planning takes."""
