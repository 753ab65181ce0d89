"""The measurement of reactions: what it counts, not how long that takes."""

import pytest

from agent.chat import latency
from tests.agent.chat.conftest import DESK


def test_every_line_is_measured():
    result = latency.measure(5, str(DESK), "geometric")
    assert result["runs"] == 5 and result["model"] == "geometric"
    assert 0 < result["reaction_seconds_median"] < result["proposal_seconds_median"] <= result["proposal_seconds_max"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--runs", "4"], "--runs cannot be 4; legal: 5 or more"),
        (["--scene", "nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_bad_options_are_told_in_a_sentence(arguments, said, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["latency", *arguments])
    with pytest.raises(SystemExit) as ended:
        latency.main()
    assert ended.value.code == 2 and said in capsys.readouterr().err
