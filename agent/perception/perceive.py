"""Find the objects that a recording shows, with the nouns that the picture gives them."""

from __future__ import annotations

from agent.perception.nouns.recognition import with_nouns
from agent.perception.segmentation import segment
from agent.perception.segments import Segments
from agent.recordings.recording import Recording
from grounding.linear_algebra import one_thread


def perceive(recording: Recording) -> Segments:
    """Find the table and the objects of a recording, and give objects nouns where picture and shape agree.

    Raises:
        BadInput: when nothing was measured, or no table is there.
    """
    with one_thread():
        return with_nouns(recording, segment(recording))
