"""Show the agent at work in a browser: the table in three dimensions, the chat, and who drives."""
