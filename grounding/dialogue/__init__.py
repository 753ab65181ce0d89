"""Apply corrections: what a reply changes in the current goal."""
