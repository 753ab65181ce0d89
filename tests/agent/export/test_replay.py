"""The actions of an exported episode build again what the run built."""

import pytest

from agent.cli.app import command_line
from agent.errors import DONE

pytest.importorskip("pyarrow.parquet", reason="the export needs the package pyarrow")


def test_an_exported_episode_ends_as_its_run(tmp_path):
    from tests.agent.export.replay import replayed

    runs, dataset = tmp_path / "runs", tmp_path / "dataset"
    run = ("run", "put the mug left of the bowl", "--model", "geometric", "--seed", "3", "--record", "--out")
    assert command_line([*run, str(runs / "one")]) == DONE
    assert command_line(["export", "lerobot", "--runs", str(runs), "--out", str(dataset)]) == DONE
    (episode,) = replayed(dataset, runs)
    assert episode.run == "one" and set(episode.offsets) == {"mug", "bowl"} and episode.agrees
