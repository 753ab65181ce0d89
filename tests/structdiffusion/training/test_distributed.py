"""Several processes on processor cores, as several GPUs would be."""

import csv
import json
from dataclasses import replace

import pytest
import torch

from structdiffusion.data.npz_files import DataFolderError
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.training.distributed import DistributedContext, in_processes
from structdiffusion.training.loop import TrainingOptions, learning_rate, train
from structdiffusion.training.run_record import RunMetadata
from tests.structdiffusion.toy import toy

CPU = torch.device("cpu")
OPTIONS = TrainingOptions(steps=6, learning_rate=2e-3, warmup=2, log_every=3, seed=5)
SEEDS = (5 * 1_000_003, 5 * 1_000_003 + 0x9E3779B1)


def work(folder, options=OPTIONS):
    """What each process does."""
    distributed = DistributedContext(cpu=True)
    model, loss = toy()
    metadata = RunMetadata("1.0", {}, 16)
    list(train(model, loss, folder, options, distributed.device, metadata=metadata, distributed=distributed))
    distributed.end()


def fail(folder, error):
    raise error(f"{folder} has no scenes")


def test_two_processes_step_by_the_mean_of_their_gradients_and_one_goes_on_alone(tmp_path):
    in_processes(work, 2, tmp_path)
    model, loss = toy()
    optimizer = torch.optim.AdamW(model.parameters(), lr=2e-3, weight_decay=0.01, fused=True)
    generators = [torch.Generator() for _ in SEEDS]
    means = []
    for step in range(6):
        optimizer.param_groups[0]["lr"] = learning_rate(step, OPTIONS)
        optimizer.zero_grad()
        seeded = [one.manual_seed(seed + step) for one, seed in zip(generators, SEEDS, strict=True)]
        mean = sum(loss(generator)["loss"] for generator in seeded) / 2
        mean.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimizer.step()
        means.append(mean.item())
    state = torch.load(tmp_path / "training_state.pt", weights_only=True)
    assert state["step"] == 6
    for name, tensor in model.state_dict().items():
        torch.testing.assert_close(state["model"][name], tensor, atol=1e-5, rtol=1e-4)
    with (tmp_path / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["step"]) for row in rows] == [3, 6]  # told once, not by each
    assert [float(row["loss"]) for row in rows] == pytest.approx([sum(means[:3]) / 3, sum(means[3:]) / 3], abs=1e-4)

    model, loss = toy()
    options = TrainingOptions(steps=9, learning_rate=2e-3, warmup=2, log_every=3, seed=5)
    resumed = list(train(model, loss, tmp_path, options, CPU, metadata=RunMetadata("1.0", {}, 16)))
    assert [row.step for row in resumed] == [9]
    sessions = json.loads((tmp_path / "training.json").read_text())["sessions"]
    assert [(s["devices"], s["first_step"], s["last_step"]) for s in sessions] == [(2, 0, 6), (1, 6, 9)]
    faster = sessions[0]["examples_per_second"] / sessions[0]["steps_per_second"]
    assert faster == pytest.approx(32, rel=0.02)


def test_two_processes_go_on_where_two_stopped(tmp_path):
    in_processes(work, 2, tmp_path)
    in_processes(work, 2, tmp_path, replace(OPTIONS, steps=9))
    record = json.loads((tmp_path / "training.json").read_text())
    assert [(s["first_step"], s["last_step"]) for s in record["sessions"]] == [(0, 6), (6, 9)]


# How the error travels does not depend on how many processes there are.
@pytest.mark.parametrize(("error", "count"), [(FileNotFoundError, 2), (DataFolderError, 1), (CheckpointError, 1)])
def test_what_stops_a_process_reaches_the_one_that_started_it(error, count, tmp_path):
    with pytest.raises(error, match="has no scenes"):
        in_processes(fail, count, tmp_path, error)
