"""Talk with the agent about one table: the conversation, its display, and its input."""
