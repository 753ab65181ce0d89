"""Train the two parsers."""
