"""The measurement of reactions: what it counts, not how long that takes."""

from agent.chat import latency
from tests.agent.chat.conftest import DESK


def test_every_line_is_measured():
    result = latency.measure(5, str(DESK), "geometric")
    assert result["runs"] == 5 and result["model"] == "geometric"
    assert 0 < result["reaction_seconds_median"] < result["proposal_seconds_median"] <= result["proposal_seconds_max"]
