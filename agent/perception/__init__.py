"""From what a depth camera measured to a table and the objects on it."""
