"""What runs share: a library is loaded once, a file at every turn."""

from pathlib import Path

import pytest

from agent.bags.recording import ReadingOf, RecordedOptions
from agent.errors import UsageError
from agent.loaded import Loaded

DESK = Path(__file__).parent / "chat" / "desk.yaml"


def test_a_library_of_simulated_scenes_is_loaded_once():
    loaded = Loaded()
    first = loaded.source("simulated", "procedural")
    # Every turn of a chat and every row of a batch brings its own options, in which nothing is said of recordings.
    assert loaded.source("simulated", "procedural", RecordedOptions(ReadingOf())) is first
    assert loaded.source("simulated", "validation", RecordedOptions(ReadingOf())) is not first


def test_files_are_read_anew_and_options_of_recordings_still_need_one():
    loaded = Loaded()
    assert loaded.source(str(DESK), "procedural") is not loaded.source(str(DESK), "procedural")
    loaded.source("simulated", "procedural")
    with pytest.raises(UsageError, match="are for recordings"):
        loaded.source("simulated", "procedural", RecordedOptions(ReadingOf(at=1.0)))
