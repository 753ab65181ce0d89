"""No trajectory is exported for an arm that is none of those that are planned for."""

from types import SimpleNamespace

import pytest

from agent import events
from agent.errors import BAD_INPUT
from agent.pipeline.run import RunOptions, run_instruction

OTHER = "the recorded arm is not supported: it has 6 joints and 2 fingers"


def test_a_trajectory_for_another_arm_is_refused_before_anything_is_planned(tmp_path):
    source = SimpleNamespace(other_arm=OTHER, referents=[], catalogue=False, hint="")
    cache = SimpleNamespace(source=lambda *_: source)
    sent = list(run_instruction("a line", RunOptions("mico.bag"), cache, trajectories=[tmp_path / "plan.json"]))
    (failed,) = [event for event in sent if isinstance(event, events.Failed)]
    assert failed.exit_code == BAD_INPUT and OTHER in failed.message and "--export-trajectory" in failed.message
    assert not (tmp_path / "plan.json").exists()


def test_without_an_export_the_run_goes_on(tmp_path):
    source = SimpleNamespace(other_arm=OTHER, referents=[], catalogue=False, hint="")
    cache = SimpleNamespace(source=lambda *_: source)
    with pytest.raises(AttributeError, match="interpreter"):  # the next thing that is needed
        list(run_instruction("a line", RunOptions("mico.bag"), cache))
