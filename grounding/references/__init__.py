"""Resolve references: which of the scene's objects an instruction means."""
