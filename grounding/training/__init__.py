"""Training of the two parsers."""
