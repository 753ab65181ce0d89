"""Recorded sessions: what a camera saw and how the arm stood, read from bags, clouds and pictures, and written to bags."""
