"""Measure how well perception segments labelled clouds and synthetic tables: `structagent evaluate segmentation`."""
