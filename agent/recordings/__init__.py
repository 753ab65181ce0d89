"""Recorded sessions: what a camera saw and how the arm stood, read from bags, clouds and pictures; bags written."""

from pathlib import Path

EXAMPLE = "example"


def example_path() -> Path:
    """Return the recorded session that comes with the project; `example/README.md` says what it shows."""
    return Path(__file__).parent / "example" / "cups.bag"


def recording_path(name: Path) -> Path:
    """Return the recording that is meant: "example" is the one that comes with the project, unless such a file is
    there."""
    return example_path() if str(name) == EXAMPLE and not name.exists() else name
