"""See objects by a network: its input from depth and colour, its arithmetic in numpy, and its weights."""
