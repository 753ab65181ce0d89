"""Perception in one step: objects and nouns, in one thread of linear algebra."""

from pathlib import Path

import threadpoolctl

from agent.perception import perceive as module
from agent.perception.perceive import perceive
from agent.recordings import example_path
from agent.recordings.load import read_recording


def test_the_example_is_perceived_in_one_thread(monkeypatch):
    numpy_alone, seen = threadpoolctl.ThreadpoolController(), []

    def threads() -> set[int]:
        return {pool["num_threads"] for pool in numpy_alone.info() if pool["user_api"] == "blas"}

    def noted(recording, segments):
        seen.append(threads())
        return segments

    monkeypatch.setattr(module, "with_nouns", noted)
    before = threads()
    segments = perceive(read_recording(Path(example_path())))
    assert len(segments.objects) == 4 and seen == [{1}] and threads() == before
