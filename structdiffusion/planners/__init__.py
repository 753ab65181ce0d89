"""Planners: from a goal and an observed scene to proposed arrangements."""
