"""Compose goals of several parts: where every object goes so that all parts hold together, from what the camera saw."""
