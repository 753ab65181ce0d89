"""Read instructions into goals of several parts with a language model, and check what it answers."""
