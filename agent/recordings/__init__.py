"""Read recorded camera and arm data from bags, clouds and pictures, and write bags."""

from pathlib import Path

EXAMPLE = "example"


def example_path() -> Path:
    """Return the path of the recorded session that comes with the project; `example/README.md` describes it."""
    return Path(__file__).parent / "example" / "cups.bag"


def recording_path(name: Path) -> Path:
    """Return the path of a recording; "example" is the shipped one unless a file of that name exists."""
    return example_path() if str(name) == EXAMPLE and not name.exists() else name
