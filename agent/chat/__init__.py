"""Talking with the agent about one table: the conversation, what is shown of it, and where its lines come from."""
