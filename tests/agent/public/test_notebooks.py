"""What scenes, proposals and results show in a notebook, and the notebook of the documents."""

import base64
import io
import os
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import nbclient
import nbformat
import numpy as np
import pytest
import structagent
from PIL import Image
from structagent import EvaluationReport, Scene, SuccessRate

ROOT = Path(__file__).parents[3]
NOTEBOOK = ROOT / "docs" / "examples" / "notebook.ipynb"
MOST_BYTES = 150_000


def pictures(html: str) -> list[np.ndarray]:
    """The pictures of an HTML text, (H, W, 3) uint8."""
    found = re.findall(r'src="data:image/webp;base64,([^"]+)"', html)
    return [np.asarray(Image.open(io.BytesIO(base64.b64decode(data)))) for data in found]


def named(clouds) -> Scene:
    return Scene.from_clouds(clouds, names=["red <b>cup"] * 4, colors=[(220, 20, 20)] * 4)


def test_a_scene_shows_its_objects_in_their_colours(clouds):
    scene = named(clouds)
    (drawn,) = pictures(scene._repr_html_())
    red = (drawn[..., 0] > 180) & (drawn[..., 1] < 90) & (drawn[..., 2] < 90)
    assert red.sum() > 2000 and red.mean() < 0.2
    assert repr(scene) == f"Scene(4 objects: {', '.join(scene.names)})"


def test_proposals_show_the_best_one_and_list_the_scores_of_a_few(clouds):
    proposals = structagent.propose(named(clouds), {"shape": "line"}, model="geometric", count=8, keep_invalid=True)
    html = proposals._repr_html_()
    (drawn,) = pictures(html)
    assert not np.array_equal(drawn, pictures(proposals.scene._repr_html_())[0])
    assert html.count("<tr>") == 1 + 6 and "<b>" not in html
    assert f"<td>{proposals.best.score:.3f}</td>" in html
    moving = sum(not np.allclose(motion, np.eye(4), atol=1e-4) for motion in proposals.best.goal_from_initial)
    assert repr(proposals.best).startswith(f"Proposal({moving} of 4 objects move; score {proposals.best.score:.3f}, ")


def test_one_proposal_says_how_many_objects_move():
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[1, 0, 3] = 0.1
    assert repr(structagent.Proposal(motions, {"total": 0.25}, False)) == (
        "Proposal(1 of 3 objects move; score 0.250, not valid)"
    )


@pytest.fixture(scope="module")
def result():
    return structagent.run("put the mug left of the bowl", seed=1, model="geometric", execute=False)


def test_a_result_shows_its_goal_its_end_and_its_checks(result):
    html = result._repr_html_()
    assert "A valid goal was found" in html and "the goal as it came to rest in physics" in html
    assert len(pictures(html)) == 3 and html.count("✓") == len(result.checks) > 0
    assert re.fullmatch(r"RunResult\(mug left of bowl: success; \d+\.\d s\)", repr(result))
    assert pickle.loads(pickle.dumps(result))._repr_html_() == html


def test_a_question_is_one_line():
    asked = structagent.parse("put the cup there", ["cup", "cup", "bowl", "mug"])
    assert repr(asked).startswith("ParsedInstruction('put the cup there': ask; ") and "\n" not in repr(asked)
    read = structagent.parse("line up the cups", ["cup", "cup"])
    assert repr(read) == "ParsedInstruction('line up the cups': ok; line of 0, 1)"


def test_an_evaluation_is_a_table():
    rate = SuccessRate("geometric", "all", 10, 9, 0.9, 0.596, 0.982, {})
    report = EvaluationReport((rate,), "structagent evaluate success", {})
    assert repr(report) == "EvaluationReport(geometric 9 of 10 stand)"
    assert "<td>9 of 10</td><td>90.0%</td><td>59.6% to 98.2%</td>" in report._repr_html_()


def kinds(notebook) -> Iterator[tuple]:
    """The kinds of the outputs of each cell."""
    for cell in notebook.cells:
        if cell.cell_type == "code":
            yield tuple((out.output_type, out.get("name"), *sorted(out.get("data", ()))) for out in cell.outputs)


def test_the_notebook_runs_and_shows_what_it_stores(tmp_path, monkeypatch):
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (ROOT, ROOT / "agent" / "public"))))
    stored, run = (nbformat.read(NOTEBOOK, as_version=4) for _ in range(2))
    nbformat.validate(stored)
    for cell in run.cells:
        cell.pop("outputs", None)
        if cell.cell_type == "code":
            cell.outputs = []
    client = nbclient.NotebookClient(run, timeout=500, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()  # raises what a cell raises
    assert list(kinds(run)) == list(kinds(stored))
    assert any("text/html" in out for cell in kinds(stored) for out in cell)
    for notebook in (run, stored):
        shown = [out.data["text/plain"] for cell in notebook.cells for out in cell.get("outputs", ()) if "data" in out]
        assert any("RunResult(circle of cup 1, cup 2, cup 3, small, left: success" in text for text in shown)


def test_the_notebook_is_small_and_has_no_error_and_no_path_of_a_machine():
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text.encode()) < MOST_BYTES
    assert '"output_type": "error"' not in text and '"stderr"' not in text
    assert not re.search(r"/(home|root|tmp|work)/", re.sub(r"base64,[^\"\\]+", "", text))
