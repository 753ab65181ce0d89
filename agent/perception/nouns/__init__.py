"""Recognise household objects in the camera's picture: a noun with a confidence, or none."""
