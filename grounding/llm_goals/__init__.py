"""Parse instructions into goals of several parts with a language model, and check its answers."""
