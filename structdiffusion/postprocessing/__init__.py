"""Process proposals: settle, refine and rank them, and try them in physics."""
