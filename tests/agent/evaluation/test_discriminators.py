"""`structagent evaluate discriminators`: rates by kind of example, on data that it is given."""

import json
import shutil
from itertools import islice

import pytest
import trimesh

from agent.cli.app import command_line
from agent.training import sentence_embeddings
from grounding.corpus.grammar import all_sentences
from structdiffusion.data import demonstrations
from structdiffusion.planners.factory import WEIGHTS


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Twelve scenes and 60 pairs of six boxes."""
    folder = tmp_path_factory.mktemp("data")
    for number in range(6):
        trimesh.creation.box((0.05, 0.05, 0.04 + 0.005 * number)).export(folder / f"box_{number}.stl")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demonstrations, "SHARD_SCENES", 12)
        patch.setattr(demonstrations, "PROVEN", 0)
        patch.setattr(sentence_embeddings, "all_sentences", lambda shapes: islice(all_sentences(shapes), 20))
        drawn = ["--scenes", "12", "--pairs", "60", "--objects", str(folder), "--workers", "1", "--seed", "3"]
        assert command_line(["generate", "--out", str(folder / "data"), *drawn]) == 0
    return folder / "data"


def test_those_that_come_along_tell_right_from_wrong(data, tmp_path, capsys):
    line = [
        "evaluate",
        "discriminators",
        "--data",
        str(data),
        "--examples",
        "240",
        "--out",
        str(tmp_path / "right.json"),
    ]
    assert command_line([*line, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((tmp_path / "right.json").read_text())
    assert report["command"].startswith(f"structagent generate --out {data} --scenes 12 ")
    structure, collision = ({row["of"]: row for row in one["rows"]} for one in report["evaluations"])
    assert structure["all"]["n"] == 280 == sum(row["n"] for name, row in structure.items() if name != "all")
    assert collision["all"]["n"] == 240 == sum(row["n"] for name, row in collision.items() if name != "all")
    assert structure["all"]["count"] == sum(row["count"] for name, row in structure.items() if name != "all")
    for rows in (structure, collision):
        assert rows["all"]["low"] > 0.5  # better than chance
    assert collision["apart by 5 mm or more"]["rate"] > collision["in by 2 to 7 mm"]["rate"]

    assert (
        command_line(["models", "card", "structure", "--eval", str(tmp_path / "right.json"), *weights(tmp_path)]) == 0
    )
    card = (tmp_path / "weights" / "structure" / "card.md").read_text()
    assert f"| structure | something out of place | {structure['something out of place']['n']} |" in card
    assert "right, percent" in card and "collision |" not in card.split("## Results")[1]


def test_the_same_seed_gives_the_same_and_another_does_not(data, capsys):
    def told(*more: str) -> str:
        assert command_line(["evaluate", "discriminators", "--data", str(data), "--examples", "60", *more]) == 0
        return capsys.readouterr().out.split("\n\n")[0]

    first = told()
    assert first == told() != told("--seed", "1")
    assert first.splitlines()[0].split()[:4] == ["discriminator", "examples", "n", "right"]


def test_a_report_that_cannot_be_kept_is_told_before_any_work(data, tmp_path, capsys):
    assert command_line(["evaluate", "discriminators", "--data", str(data), "--out", str(tmp_path)]) == 2
    assert f"--out must be a file, but '{tmp_path}' is a folder" in capsys.readouterr().err


def test_a_folder_without_data_is_named(tmp_path, capsys):
    assert command_line(["evaluate", "discriminators", "--data", str(tmp_path)]) == 6
    assert f"{tmp_path} has no library.npz; make it with `structagent generate" in capsys.readouterr().err


def weights(folder) -> list[str]:
    """A folder with the networks that come along, whose cards may be written anew."""
    for name in ("structure", "collision"):
        shutil.copytree(WEIGHTS / name, folder / "weights" / name)
    return ["--weights", str(folder / "weights")]
