"""Worker processes: every row has its result, whatever becomes of a worker."""

import multiprocessing
import os
import shutil
import signal
import sys

import numpy as np
import pytest
import trimesh

from agent.batch import workers
from agent.batch.row_task import carry_out
from agent.batch.rows import Row
from agent.batch.workers import Job, run_locally, run_on_ray
from agent.errors import UsageError
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions


@pytest.fixture
def jobs(tmp_path) -> list[Job]:
    """Three rows: a tower of two boxes, something that is no arrangement, and a tower once more."""
    meshes = tmp_path / "boxes"
    meshes.mkdir()
    for number in range(2):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(meshes / f"box_{number}.stl")
    options = RunOptions(objects=str(meshes), model="geometric", execute=False)
    texts = {"first": "stack two boxes", "second": "fly to the moon", "third": "stack two boxes"}
    return [
        Job(Row(line, name, text, options, "0"), tmp_path / name)
        for line, (name, text) in enumerate(texts.items(), start=1)
    ]


def timeless(result: dict) -> dict:
    return {key: value for key, value in result.items() if key != "seconds"}


def test_results_and_reports_of_one_process(jobs):
    results = list(run_locally(jobs, 1))
    first, second, third = results
    assert [result["id"] for result in results] == ["first", "second", "third"]
    assert first["success"] and first["exit_code"] == 0 and first["spec"]["shape"] == "tower"
    assert first["rank"] == 1 and 0 < first["score"] <= 1
    assert all(check["passed"] and np.isfinite(check["measured"]) for check in first["checks"])
    assert first["report"] == "rows/first/report.html" and (jobs[0].folder / "report.html").is_file()
    assert first["seconds"]["total"] > 0 < third["seconds"]["total"]
    assert timeless(third) == timeless(first) | {"id": "third", "line": 3, "report": "rows/third/report.html"}
    assert (second["exit_code"], second["step"], second["report"]) == (3, "parse", None)
    assert "ask for an arrangement" in second["message"] and not jobs[1].folder.exists()
    assert not multiprocessing.active_children()


def dies_at_the_first(cache: ResourceCache, job: Job) -> dict:
    """Carries rows out in a worker, which is killed at one of them."""
    if job.row.id == "first":
        os.kill(os.getpid(), signal.SIGKILL)
    return carry_out(job.row, job.folder, cache)


def test_a_worker_that_dies_takes_its_row_along_and_no_other(jobs, monkeypatch):
    monkeypatch.setattr(workers, "_carried_out", dies_at_the_first)
    first, second, third = run_locally(jobs, 1)
    assert not first["success"] and (first["exit_code"], first["step"]) == (1, "crash")
    assert first["message"] == "worker died (SIGKILL)" and first["seconds"] == {}
    assert second["exit_code"] == 3 and third["success"]


def test_workers_end_when_nobody_waits_for_them_any_more(jobs):
    results = run_locally(jobs, 2)
    next(results)
    assert multiprocessing.active_children()
    results.close()
    assert not multiprocessing.active_children()


def test_without_ray_a_sentence_says_how_to_install_it(jobs, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UsageError, match=r"pip install 'structagent\[ray\]'"):
        next(run_on_ray(jobs, "local", 1))


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("127.0.0.1:1", "no server answers there"),
        ("ray://127.0.0.1:1", "no server answers there"),
        ("here", "legal: local"),
    ],
)
def test_a_cluster_that_is_not_there(jobs, address, said):
    with pytest.raises(UsageError, match=f"--ray cannot be '{address}'.*{said}"):
        next(run_on_ray(jobs, address, 1))


def test_ray_has_the_same_results(jobs):
    here = {result["id"]: timeless(result) for result in run_locally(jobs, 2)}
    pages = {job.row.id: (job.folder / "report.html").is_file() for job in jobs}
    for job in jobs:
        shutil.rmtree(job.folder, ignore_errors=True)
    there = {result["id"]: timeless(result) for result in run_on_ray(jobs, "local", 2)}
    assert there == here
    assert {job.row.id: (job.folder / "report.html").is_file() for job in jobs} == pages
    assert pages == {"first": True, "second": False, "third": True}
