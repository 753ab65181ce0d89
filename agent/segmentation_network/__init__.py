"""See objects by a network: its input from depth and colour, its arithmetic in numpy, and its weights."""

from pathlib import Path

WEIGHTS = Path(__file__).parent / "weights"
