"""What runs share: a library is loaded once, a file at every turn."""

from pathlib import Path

import pytest
import trimesh

from agent.errors import UsageError
from agent.pipeline.resources import ResourceCache
from agent.recordings.recording import ReadingOf, RecordedOptions

DESK = Path(__file__).parents[1] / "chat" / "desk.yaml"


def block(folder: Path, width: float) -> str:
    """A library of one block."""
    folder.mkdir()
    trimesh.creation.box((width, 0.05, 0.06)).export(folder / "block.stl")
    return str(folder)


def test_a_library_of_simulated_scenes_is_loaded_once(tmp_path):
    blocks, others = block(tmp_path / "blocks", 0.05), block(tmp_path / "others", 0.04)
    cache = ResourceCache()
    first = cache.source("simulated", blocks)
    # Every turn of a chat and every row of a batch brings its own options, in which nothing is said of recordings.
    assert cache.source("simulated", blocks, RecordedOptions(ReadingOf())) is first
    assert cache.source("simulated", others, RecordedOptions(ReadingOf())) is not first
    # What only a recording can answer is still an error, though the library is there.
    with pytest.raises(UsageError, match="are for recordings"):
        cache.source("simulated", blocks, RecordedOptions(ReadingOf(at=1.0)))


def test_files_are_read_anew():
    cache = ResourceCache()
    assert cache.source(str(DESK), "procedural") is not cache.source(str(DESK), "procedural")
