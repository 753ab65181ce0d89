"""Recorded sessions: what a camera saw and how the arm stood, read from bags, clouds and pictures, and written to bags."""

from pathlib import Path


def example_path() -> Path:
    """The recorded session that comes with the project; `example/README.md` says what it shows."""
    return Path(__file__).parent / "example" / "cups.bag"
