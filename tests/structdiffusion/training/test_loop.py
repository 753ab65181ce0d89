import csv
import hashlib
import json
import math
from dataclasses import replace
from functools import partial

import pytest
import torch

from grounding.atomic_files import OpenFolder
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.checkpoint import CheckpointError, parameter_count
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.loss import diffusion_loss
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.diffusion.scheduler import NoiseScheduler
from structdiffusion.training import loop
from structdiffusion.training.loop import TrainingOptions, learning_rate, train
from structdiffusion.training.run_record import RunMetadata
from tests.structdiffusion.toy import toy

CPU = torch.device("cpu")
OPTIONS = TrainingOptions(steps=20, learning_rate=2e-3, warmup=2, log_every=5)


def rows(folder):
    with (folder / "log.csv").open() as file:
        return list(csv.DictReader(file))


def test_the_denoiser_overfits_a_few_scenes(data_folder, tmp_path):
    data = DemonstrationBatches(data_folder)
    batch = data.draw(8, torch.Generator().manual_seed(0))
    data.draw = lambda *_, **__: batch  # always the same scenes
    torch.manual_seed(0)
    model = PoseDiffusion(DiffusionConfig(width=48, layers=2, heads=2, feed_forward=64, points=24, point_width=16))
    loss = partial(diffusion_loss, model, NoiseScheduler(200), data, scenes=8, noises=4)
    options = TrainingOptions(steps=120, learning_rate=3e-3, warmup=10, log_every=20)
    progress = list(train(model, loss, tmp_path, options, CPU))
    assert [row.step for row in progress] == [20, 40, 60, 80, 100, 120]
    assert progress[-1].losses["loss"] < 0.5 * progress[0].losses["loss"]
    assert progress[-1].losses["position"] < 0.6 * progress[0].losses["position"]
    assert not model.training


def test_a_stopped_run_goes_on_where_it_stopped(tmp_path):
    model, loss = toy()
    list(train(model, loss, tmp_path, OPTIONS, CPU))
    assert [int(row["step"]) for row in rows(tmp_path)] == [5, 10, 15, 20]
    model, loss = toy()
    resumed = list(train(model, loss, tmp_path, replace(OPTIONS, steps=33), CPU))
    assert [row.step for row in resumed] == [25, 30, 33]
    logged = rows(tmp_path)
    assert [int(row["step"]) for row in logged] == [5, 10, 15, 20, 25, 30, 33]
    assert list(logged[0]) == ["step", "seconds", "learning_rate", "loss"]
    seconds = [float(row["seconds"]) for row in logged]
    assert seconds == sorted(seconds)
    # It begins with the trained weights, not with new ones.
    assert float(logged[4]["loss"]) < float(logged[0]["loss"])


def test_a_finished_run_has_nothing_to_do_and_gives_its_weights(tmp_path):
    model, loss = toy()
    list(train(model, loss, tmp_path, OPTIONS, CPU))
    other, loss = toy()
    assert list(train(other, loss, tmp_path, OPTIONS, CPU)) == []
    for name, tensor in model.state_dict().items():
        torch.testing.assert_close(other.state_dict()[name], tensor, atol=0, rtol=0)


def test_what_cannot_be_gone_on_with_is_told(tmp_path):
    model, loss = toy()
    metadata = RunMetadata("1.0", {"name": "toy"}, batch=16)
    list(train(model, loss, tmp_path, replace(OPTIONS, steps=2), CPU, metadata=metadata))
    other = CollisionDiscriminator(CollisionConfig(width=16, layers=1, points=8))
    with pytest.raises(CheckpointError, match="training_state.pt cannot be resumed: it is torn, or not that"):
        list(train(other, loss, tmp_path, OPTIONS, CPU))
    (tmp_path / "training.json").write_text('{"sessions"')
    with pytest.raises(CheckpointError, match="training.json is not a training record"):
        list(train(model, loss, tmp_path, OPTIONS, CPU, metadata=metadata))
    state = tmp_path / "training_state.pt"
    state.write_bytes(state.read_bytes()[:1000])
    with pytest.raises(CheckpointError, match="training_state.pt cannot be resumed"):
        list(train(model, loss, tmp_path, OPTIONS, CPU))


def test_the_checkpoint_holds_the_averaged_weights(tmp_path):
    model, loss = toy()
    start = {name: tensor.clone() for name, tensor in model.state_dict().items()}
    list(train(model, loss, tmp_path, replace(OPTIONS, average=0.9), CPU))
    saved = CollisionDiscriminator.from_pretrained(tmp_path).state_dict()
    state = torch.load(tmp_path / "training_state.pt", weights_only=True)
    assert state["step"] == 20
    for name, tensor in model.state_dict().items():  # train() leaves the average in the model
        torch.testing.assert_close(saved[name], tensor.half().float(), atol=0, rtol=0)
        torch.testing.assert_close(state["average"][name], tensor, atol=0, rtol=0)
    last, average = (torch.cat([part[name].flatten() for name in start]) for part in (state["model"], state["average"]))
    first = torch.cat([tensor.flatten() for tensor in start.values()])
    assert 0 < (last - average).norm() < (last - first).norm()


def test_same_seed_same_weights(tmp_path):
    weights = []
    for folder, seed in (("a", 1), ("b", 1), ("c", 2)):
        model, loss = toy()
        list(train(model, loss, tmp_path / folder, replace(OPTIONS, seed=seed), CPU))
        weights.append(torch.cat([tensor.flatten() for tensor in model.state_dict().values()]))
    assert torch.equal(weights[0], weights[1]) and not torch.equal(weights[0], weights[2])


def test_one_device_takes_plain_steps(tmp_path):
    """The loop against one that is written out: nothing of several devices, records or precision touches its bits."""
    model, loss = toy()
    list(train(model, loss, tmp_path, OPTIONS, CPU, metadata=RunMetadata("1.0", {}, 16)))
    plain, loss = toy()
    optimizer = torch.optim.AdamW(plain.parameters(), lr=2e-3, weight_decay=0.01, fused=True)
    average = {name: tensor.clone() for name, tensor in plain.state_dict().items()}
    generator = torch.Generator()
    for step in range(20):
        optimizer.param_groups[0]["lr"] = learning_rate(step, OPTIONS)
        optimizer.zero_grad()
        loss(generator.manual_seed(step))["loss"].backward()
        torch.nn.utils.clip_grad_norm_(plain.parameters(), 1.0)
        optimizer.step()
        for name, tensor in plain.state_dict().items():
            average[name].lerp_(tensor, 1 - min(0.999, (step + 2) / (step + 11)))
    for name, tensor in model.state_dict().items():
        torch.testing.assert_close(tensor, average[name], atol=0, rtol=0)


def test_the_record_tells_sessions_speed_and_checksums(tmp_path):
    here = RunMetadata("1.0", {"name": "toys", "scenes": 7}, batch=16)
    for steps, metadata in ((20, here), (30, replace(here, version="1.1")), (40, replace(here, version="1.1"))):
        model, loss = toy()
        list(train(model, loss, tmp_path, replace(OPTIONS, steps=steps), CPU, metadata=metadata))
    record = json.loads((tmp_path / "training.json").read_text())
    assert (record["kind"], record["parameters"], record["steps"]) == ("collision", parameter_count(model), 40)
    spans = [(s["version"], s["first_step"], s["last_step"], s["options"]["steps"]) for s in record["sessions"]]
    assert spans == [("1.0", 0, 20, 20), ("1.1", 20, 30, 30), ("1.1", 30, 40, 40)]
    assert all(session["data"] == {"name": "toys", "scenes": 7} for session in record["sessions"])
    last = record["sessions"][-1]
    assert last["steps_per_second"] > 0
    assert last["examples_per_second"] == pytest.approx(16 * last["steps_per_second"], rel=0.01)
    assert sum(session["seconds"] for session in record["sessions"]) == pytest.approx(record["seconds"], abs=0.2)
    weights = (tmp_path / "model.safetensors").read_bytes()
    told = record["files"]["model.safetensors"]
    assert told == {"bytes": len(weights), "sha256": hashlib.sha256(weights).hexdigest()}
    assert record["losses"]["loss"] == pytest.approx(float(rows(tmp_path)[-1]["loss"]), abs=1e-5)


def test_a_run_that_was_only_interrupted_is_one_session(tmp_path):
    """Checkpoints come while it runs; whoever starts it again with the same words goes on with the same session."""
    here, halfway = RunMetadata("1.0", {}, 16), replace(OPTIONS, save_seconds=0.0)
    model, loss = toy()
    run = train(model, loss, tmp_path, halfway, CPU, metadata=here)
    assert [next(run).step, next(run).step] == [5, 10]
    run.close()  # the last checkpoint is that of step 10
    model, loss = toy()
    list(train(model, loss, tmp_path, halfway, CPU, metadata=here))
    (session,) = json.loads((tmp_path / "training.json").read_text())["sessions"]
    assert (session["first_step"], session["last_step"]) == (0, 20)


class Killed(BaseException):
    """Ends a run as a signal does."""


@pytest.mark.parametrize("writes", range(1, 14))
def test_a_run_that_is_killed_at_any_write_ends_as_one_that_was_not(writes, tmp_path, monkeypatch):
    """A killed run repeats what it had not saved, and draws what it drew before:
    the weights are the same to the bit.
    """
    here, often = RunMetadata("1.0", {}, 16), replace(OPTIONS, save_seconds=0.0)

    def run(folder) -> None:
        model, loss = toy()
        list(train(model, loss, tmp_path / folder, often, CPU, metadata=here))

    run("whole")
    replace_file, left = OpenFolder.replace, iter([True] * writes)

    def killed(place, *names):
        if not next(left, False):
            raise Killed
        replace_file(place, *names)

    monkeypatch.setattr(OpenFolder, "replace", killed)
    with pytest.raises(Killed):
        run("killed")
    monkeypatch.undo()
    run("killed")
    whole, resumed = tmp_path / "whole", tmp_path / "killed"
    assert sorted(path.name for path in resumed.iterdir()) == sorted(path.name for path in whole.iterdir())
    for name in ("config.json", "model.safetensors"):
        assert (resumed / name).read_bytes() == (whole / name).read_bytes()
    assert [row["step"] for row in rows(resumed)] == [row["step"] for row in rows(whole)]
    assert [row["loss"] for row in rows(resumed)] == [row["loss"] for row in rows(whole)]
    told = json.loads((resumed / "training.json").read_text())
    assert told["files"] == json.loads((whole / "training.json").read_text())["files"]
    assert [(session["first_step"], session["last_step"]) for session in told["sessions"]] == [(0, 20)]


def test_seconds_without_a_record_are_not_a_later_sessions(tmp_path, monkeypatch):
    model, loss = toy()
    now = 0.0
    monkeypatch.setattr(loop.time, "monotonic", lambda: now)

    def slow(generator):
        nonlocal now
        now += 0.05
        return loss(generator)

    list(train(model, slow, tmp_path, OPTIONS, CPU))  # a second and more, of which nobody keeps a record
    model, loss = toy()
    list(train(model, loss, tmp_path, replace(OPTIONS, steps=30), CPU, metadata=RunMetadata("1.0", {}, 16)))
    record = json.loads((tmp_path / "training.json").read_text())
    (session,) = record["sessions"]
    unrecorded = float(rows(tmp_path)[3]["seconds"])
    assert unrecorded == pytest.approx(1.0)
    assert session["seconds"] == pytest.approx(record["seconds"] - unrecorded, abs=0.01)


def test_weights_are_not_saved_before_the_loss_is_known_to_be_a_number(tmp_path):
    model, loss = toy()
    steps = iter(range(100))

    def lost(generator):
        factor = torch.nan if next(steps) == 2 else 1.0
        return {name: factor * value for name, value in loss(generator).items()}

    with pytest.raises(FloatingPointError, match="lower the learning rate"):
        list(train(model, lost, tmp_path, replace(OPTIONS, save_seconds=0.0), CPU))
    assert not (tmp_path / "training_state.pt").exists() and not (tmp_path / "model.safetensors").exists()


def test_the_rate_warms_up_holds_and_falls():
    options = TrainingOptions(steps=1000, learning_rate=1e-3, warmup=100, decay=0.4)
    assert learning_rate(0, options) == pytest.approx(1e-5)
    assert learning_rate(49, options) == pytest.approx(5e-4)
    assert {learning_rate(step, options) for step in (100, 300, 600)} == {1e-3}
    assert learning_rate(800, options) == pytest.approx(5e-4)
    assert 0 < learning_rate(999, options) < 1e-5
    constant = replace(options, decay=0.0)
    assert learning_rate(999, constant) == 1e-3


def test_a_loss_that_is_no_number_stops_the_run_and_says_when(tmp_path):
    model, loss = toy()

    def broken(generator):
        return {"loss": loss(generator)["loss"] * math.nan}

    with pytest.raises(FloatingPointError, match="at step 5; lower the learning rate"):
        list(train(model, broken, tmp_path, OPTIONS, CPU))
    assert not (tmp_path / "model.safetensors").exists()
