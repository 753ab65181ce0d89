"""What the Rerun viewer gets, read back from the file by Rerun's own reader."""

import sys
from collections import defaultdict

import numpy as np
import pytest
from rerun.chunk import RrdReader

from agent import events
from agent.errors import UsageError
from agent.pipeline.building import build_with_arm
from agent.pipeline.event_builders import chosen_event, perceived_event
from agent.reporting.rerun_log import CANDIDATES, EVERY, RerunLog
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.depth_camera import VIEWS

STEPS = 400  # of physics, after which the build is interrupted


def rows_of(path) -> dict[str, list[dict]]:
    """Entity -> its rows, each component's name -> its value, in the order of the timeline."""
    rows = defaultdict(list)
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        columns = {name: batch.column(name) for name in batch.schema.names if name == "physics" or ":" in name}
        if "physics" in columns:
            columns["physics"] = columns["physics"].cast("int64")  # nanoseconds
        run_events = {name: column.to_pylist() for name, column in columns.items()}
        rows[chunk.entity_path] += [
            dict(zip(run_events, row, strict=True)) for row in zip(*run_events.values(), strict=True)
        ]
    return {entity: sorted(found, key=lambda row: row.get("physics", 0)) for entity, found in rows.items()}


def values(rows: list[dict], component: str) -> list[np.ndarray]:
    return [np.array(row[component]) for row in rows if row.get(component) is not None]


@pytest.fixture
def recording(table, tmp_path):
    """A build that is interrupted while the arm reaches for the first box, and where everything was then."""
    scene, path, passed = table.look(), tmp_path / "new" / "run.rrd", [0]
    motions = np.tile(np.eye(4), (2, 1, 1))
    motions[0, 1, 3] = 0.1
    arrangement = Arrangement(motions, {"total": 1.0})
    with RerunLog(path) as log:
        hand = []

        def on_step(watched) -> None:
            log.on_physics_step(watched)
            if passed[0] % EVERY == 0:
                hand.append(watched.arm.world_from_ee())
            passed[0] += 1
            if passed[0] == STEPS:
                raise KeyboardInterrupt

        log.on_event(events.Started("put the box to the left", {}))
        log.on_event(perceived_event(scene, 0.1))
        log.on_event(events.Proposed("geometric", (), 0.1, scene=scene, arrangements=(arrangement,) * (CANDIDATES + 2)))
        log.on_event(chosen_event(1, arrangement, scene))
        with pytest.raises(KeyboardInterrupt):
            for event in build_with_arm(
                table, scene, StructureSpec("line"), [arrangement], 0, film=False, on_step=on_step
            ):
                log.on_event(event)
    return scene, motions, table, hand, rows_of(path)


def test_recording_has_clouds_camera_candidates_goal_objects_arm_and_story(recording):
    scene, motions, table, hand, rows = recording

    first = rows["/world/objects/" + scene.objects[0].name.replace(" ", "\\ ")]
    assert np.allclose(values(first, "Points3D:positions")[0], scene.objects[0].points)
    moved = values(first, "Transform3D:translation")
    assert len(moved) == 1 + len(hand) and np.allclose(moved[0], 0.0) and np.abs(moved[-1]).max() < 0.05

    goals = [rows[f"/world/candidates/rank_{rank}"] for rank in range(1, CANDIDATES + 1)] + [rows["/world/goal"]]
    assert f"/world/candidates/rank_{CANDIDATES + 1}" not in rows
    count = len(scene.objects[0].points)
    for goal in goals:
        points = values(goal, "Points3D:positions")[0]
        assert np.allclose(points[:count].mean(axis=0) - scene.objects[0].centroid, motions[0, :3, 3], atol=1e-5)
    red, green, blue = scene.objects[0].colors.mean(axis=0).round().astype(int).tolist()
    packed = (red << 24) + (green << 16) + (blue << 8) + 255
    assert values(goals[-1], "Points3D:colors")[0][0] == packed

    camera = rows["/world/camera"][0]
    assert np.allclose(camera["Transform3D:translation"][0], VIEWS["robot"].eye)
    lens = np.array(rows["/world/camera/image"][0]["Pinhole:image_from_camera"][0]).reshape(3, 3).T
    pixel = lens @ (np.linalg.inv(VIEWS["robot"].world_from_camera) @ (*scene.objects[0].centroid, 1.0))[:3]
    assert np.allclose(pixel[:2] / pixel[2], VIEWS["robot"].pixels(scene.objects[0].centroid), atol=0.01)

    link = rows[f"/world/arm/link_{table.arm.end_effector + 1}"]
    assert np.allclose(np.concatenate(values(link, "Transform3D:translation")), [h[:3, 3] for h in hand], atol=1e-4)
    assert max(np.linalg.norm(pose[:3, 3] - hand[0][:3, 3]) for pose in hand) > 0.05  # the arm has moved
    seconds = [row["physics"] / 1e9 for row in link]
    assert np.allclose(np.diff(seconds), EVERY / 240)

    run_events = [row["TextLog:text"][0] for row in rows["/story"]]
    assert run_events[0] == "“put the box to the left”" and "chose candidate 1" in run_events
    assert any(line.startswith("planned candidate 1") for line in run_events)
    assert any(line.startswith("stopped") for line in run_events)


def test_without_rerun_it_says_how_to_install_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UsageError, match=r"pip install 'structagent\[viz\]'"):
        RerunLog(tmp_path / "run.rrd")


def test_a_place_that_cannot_be_written_is_a_usage_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write the recording"):
        RerunLog(tmp_path / "file" / "run.rrd")
    with pytest.raises(UsageError, match="Is a directory"):
        RerunLog(tmp_path)
