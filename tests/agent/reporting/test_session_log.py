"""A session file keeps what happened, survives a kill, and is read back or refused with the line's number."""

import io
import json

import pytest
from PIL import Image

from agent import events
from agent.cli.report import replay as replay_verb
from agent.cli.report import report as report_verb
from agent.errors import BadInput, UsageError
from agent.reporting import session_reader
from agent.reporting.event_schema import event_classes, payload_error
from agent.reporting.replay import records_of, replay
from agent.reporting.run_report import RunRecord
from agent.reporting.session_format import READABLE_VERSIONS, upgrade_payload
from agent.reporting.session_log import SessionWriter, run_session
from agent.reporting.session_reader import read_session
from agent.runtime.redaction import without_credentials
from tests.agent.event_log import EventLog


@pytest.fixture
def path(run_events, tmp_path):
    """A session of one turn, with its pictures."""
    path = tmp_path / "kept" / "session.jsonl"
    with SessionWriter(path, {"seed": 0}) as session:
        record = RunRecord(session)
        for event in run_events:
            record.on_event(event)
    return path


def lines_of(path) -> list[dict]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def test_session_gives_back_the_report_and_every_picture(run_events, path):
    live = RunRecord()
    for event in run_events:
        live.on_event(event)
    session = read_session(path)
    (record,) = records_of(session)
    assert record.report == live.report and record.pictures == live.pictures
    assert session.options == {"seed": 0} and session.version == record.report["version"]
    assert [line.seconds for line in session.lines] == sorted(line.seconds for line in session.lines)
    for content in record.pictures.values():
        assert Image.open(io.BytesIO(content)).format == "WEBP"


def test_every_line_is_in_the_file_as_soon_as_it_is_sent(run_events, tmp_path):
    path = tmp_path / "session.jsonl"
    session = SessionWriter(path, {})
    for number, event in enumerate(run_events, start=1):
        session.on_event(event)
        assert len(lines_of(path)) == 1 + number
    session.close()


def test_previews_are_not_kept(tmp_path):
    path = tmp_path / "session.jsonl"
    with SessionWriter(path, {}) as session:
        session.on_event(events.Previewed(1, 25, (((0.0, 0.0, 0.0),),), ((0.0,),)))
    assert len(lines_of(path)) == 1


@pytest.mark.parametrize("cut", [1, 20])
def test_torn_last_line_is_passed_over(path, cut):
    whole = read_session(path)
    path.write_bytes(path.read_bytes()[:-cut])
    assert read_session(path).lines in (whole.lines, whole.lines[:-1])


def test_a_torn_session_is_continued(run_events, path):
    before = read_session(path)
    path.write_bytes(path.read_bytes()[:-20])
    with SessionWriter(path, {"seed": 1}) as session:
        session.on_event(run_events[0])
    after = read_session(path)
    assert after.lines[:-1] == before.lines[:-1]
    assert after.lines[-1].event["instruction"] == run_events[0].instruction
    assert after.lines[-1].seconds >= before.lines[-2].seconds
    assert len(records_of(after)) == 2


def test_other_files_are_not_written_into(tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("mine")
    with pytest.raises(UsageError, match="notes.txt.*not a session"):
        SessionWriter(notes, {})
    assert notes.read_text() == "mine"
    with pytest.raises(UsageError, match="cannot write the session"):
        SessionWriter(notes / "session.jsonl", {})


def test_session_of_a_run_begins_with_what_it_saw_and_replaces_an_earlier_one(run_events, tmp_path):
    with run_session(tmp_path / "out", {}) as session:
        session.on_event(run_events[0])
        session.on_event(run_events[-2])
    assert not (tmp_path / "out").exists()
    for _ in range(2):
        with run_session(tmp_path / "out", {}) as session:
            for event in run_events:
                session.on_event(event)
    kinds = [line.event["kind"] for line in read_session(tmp_path / "out" / "session.jsonl").lines]
    assert kinds == [event.to_dict()["kind"] for event in run_events]


def test_keys_and_passwords_are_in_no_file(run_events, tmp_path):
    url = "https://someone:hunter2@models.example:8080/v1?key=hunter3"
    options = {"seed": 0, "reading": {"llm_url": url, "parser": "llm"}}
    path = tmp_path / "session.jsonl"
    with SessionWriter(path, options) as session:
        record = RunRecord(session)
        for event in (events.Started("stack the cans", options), *run_events[1:]):
            record.on_event(event)
    page = record.write(tmp_path / "report")
    for text in (path.read_text(), record.json(), page.read_text(encoding="utf-8")):
        assert "hunter" not in text and "someone" not in text
    assert record.report["options"]["reading"]["llm_url"] == "https://models.example:8080/v1"
    assert read_session(path).options == record.report["options"]


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("https://models.example/v1", "https://models.example/v1"),
        ("someone:hunter2@models.example/v1", "models.example/v1"),
        ("http://someone:hunt@er2@[::1]:8080/v1#key", "http://[::1]:8080/v1"),
        ("http://models.example?key=a@b", "http://models.example"),
    ],
)
def test_addresses_are_shown_without_what_is_secret(address, shown):
    given = {"options": [{"llm_url": address}, {"objects": "a@b/meshes", "llm_url": None}]}
    expected = {"options": [{"llm_url": shown}, {"objects": "a@b/meshes", "llm_url": None}]}
    assert without_credentials(given) == expected


@pytest.mark.parametrize(
    ("number", "line", "parts"),
    [
        (1, "no JSON", ("not a session",)),
        (1, '{"seconds": 0}', ("not a session",)),
        (1, None, ("schema version 99", *map(str, READABLE_VERSIONS))),
        (3, "{", ("line 3", "not JSON")),
        (3, "\xff", ("line 3",)),
        (3, "[" * 100_000, ("line 3", "not JSON")),
        (3, "[1, 2]", ("line 3", "seconds")),
        (3, '{"seconds": -1, "event": {"kind": "noted", "message": ""}}', ("line 3", "seconds")),
        (3, '{"seconds": 1}', ("line 3", "event", "picture")),
        (3, '{"seconds": 1, "event": {"kind": "exploded"}}', ("line 3", "'exploded'", "started", "planned")),
        (3, '{"seconds": 1, "event": {"kind": "noted"}}', ("line 3", "noted.message is missing")),
        (3, '{"seconds": 1, "picture": {"name": "a", "caption": "", "format": "webp", "data": "%"}}',
         ("line 3", "base64")),
        (3, '{"seconds": 1, "picture": {"name": "a", "caption": "", "format": "svg", "data": ""}}',
         ("line 3", "'svg'", "webp")),
    ],
)  # fmt: skip
def test_broken_lines_are_named(path, number, line, parts):
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[number - 1] = json.dumps(json.loads(lines[0]) | {"schema_version": 99}) if line is None else line
    path.write_text("\n".join(lines) + "\n", encoding="latin-1" if line == "\xff" else "utf-8", errors="replace")
    with pytest.raises(BadInput) as caught:
        read_session(path)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_no_file_and_empty_file_are_bad_input(tmp_path):
    with pytest.raises(BadInput, match="nowhere.jsonl.*No such file"):
        read_session(tmp_path / "nowhere.jsonl")
    (tmp_path / "empty.jsonl").write_text("\n")
    with pytest.raises(BadInput, match="not a session"):
        read_session(tmp_path / "empty.jsonl")


def test_payloads_of_events_are_distinguished_from_other_objects(run_events):
    for event in run_events:
        assert payload_error(event.to_dict()) is None
    assert {"started", "stopped", "restored", "plan_failed", "finished"} <= event_classes().keys()
    perceived = run_events[2].to_dict()
    perceived["objects"][1]["position"] = [0.1, "far", 0.0]
    assert payload_error(perceived) == "perceived.objects[1].position[1] must be a number"
    perceived["objects"][1]["position"] = [0.1, 0.0]
    assert payload_error(perceived) == "perceived.objects[1].position must have 3 entries"
    assert payload_error({"kind": "noted", "message": 3}) == "noted.message must be a string"
    assert payload_error({"kind": "failed", "step": "a", "message": "b", "exit_code": True}).endswith("a whole number")
    assert "kind" in payload_error(["noted"])


@pytest.mark.parametrize(
    ("kind", "change", "part"),
    [
        ("proposed", lambda payload: payload["candidates"][2]["positions"].pop(), "[2].positions must have 3 entries"),
        (
            "proposed",
            lambda payload: payload["candidates"][1]["turns"].pop(),
            "candidates[1].turns must have 3 entries",
        ),
        ("proposed", lambda payload: payload.update(seconds=None), "proposed.seconds must be a number"),
        ("proposed", lambda payload: payload.update(seconds=1e300), "proposed.seconds must be a number"),
        ("chosen", lambda payload: payload["goals"][0].pop("name"), "chosen.goals[0].name must be a string"),
        ("planned", lambda payload: payload["order"].append(1), "planned.grasps must have as many entries"),
        ("planned", lambda payload: payload["order"].__setitem__(0, 3), "planned.order must have numbers from 0"),
    ],
)
def test_what_does_not_go_with_the_scene_is_refused(path, kind, change, part):
    lines = lines_of(path)
    number = next(n for n, line in enumerate(lines) if line.get("event", {}).get("kind") == kind)
    change(lines[number]["event"])
    path.write_text("\n".join(map(json.dumps, lines)) + "\n")
    with pytest.raises(BadInput) as caught:
        read_session(path)
    assert f"line {number + 1} of" in str(caught.value) and part in str(caught.value)


def test_what_was_tried_goes_with_the_scene(run_events, path):
    places = [[0.1, 0.2, 0.03]] * 3
    lines = lines_of(path)
    place = 1 + next(n for n, line in enumerate(lines) if line.get("event", {}).get("kind") == "chosen")
    for count, fits in ((3, True), (2, False)):
        tried = {"kind": "tried", "positions": places[:count], "turns": [0.0] * 3}
        edited = [*lines[:place], {"seconds": lines[place]["seconds"], "event": tried}, *lines[place:]]
        path.write_text("\n".join(map(json.dumps, edited)) + "\n")
        if fits:
            assert any(line.event == tried for line in read_session(path).lines)
        else:
            with pytest.raises(BadInput, match="tried.positions must have 3 entries"):
                read_session(path)


def test_replay_sends_every_event_with_the_pauses_as_they_were(run_events, path):
    session, again, pauses = read_session(path), EventLog(), []
    replay(session, again, speed=2.0, sleep=pauses.append)
    assert [event.to_dict() for event in again] == [event.to_dict() for event in run_events]
    last = next(line for line in reversed(session.lines) if line.event is not None)
    assert sum(pauses) == pytest.approx(last.seconds / 2) and min(pauses) >= 0


def test_verbs_show_a_session_and_make_its_page(path, capsys):
    replay_verb(path, speed=0.001)  # no terminal, no pauses
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    for part in ("put the cups in a small circle", "3 cup 3", "picked cup 1", "largest gap over the mean: inf"):
        assert part in shown, part
    replay_verb(path, json_output=True)
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert rows[-1]["event"]["kind"] == "finished" and rows[0]["seconds"] <= rows[-1]["seconds"]
    report_verb(path)
    assert capsys.readouterr().out == f"report: {path.with_suffix('.html')}\n"
    text = path.with_suffix(".html").read_text(encoding="utf-8")
    assert "Scene before" in text and text.count("data:image/webp") >= 3


def test_verbs_refuse_what_makes_no_sense(path):
    with pytest.raises(UsageError, match="--speed cannot be 0; legal: a number above 0"):
        replay_verb(path, speed=0.0)
    for target, what in ((path, "the session itself"), (path.parent, "a folder")):
        with pytest.raises(UsageError, match=what):
            report_verb(path, target)
    with pytest.raises(UsageError, match="cannot write the page"):
        report_verb(path, path / "page.html")


def test_two_cannot_write_one_session(tmp_path):
    path = tmp_path / "session.jsonl"
    with SessionWriter(path, {}), pytest.raises(UsageError, match="another process writes the session"):
        SessionWriter(path, {})
    SessionWriter(path, {}).close()


def test_what_never_ends_is_refused_by_its_beginning(tmp_path):
    endless = tmp_path / "endless.jsonl"
    endless.symlink_to("/dev/zero")
    with pytest.raises(BadInput, match="is not a session of structagent"):
        read_session(endless)


def test_a_session_that_is_too_large_is_refused(path, monkeypatch):
    size = path.stat().st_size
    monkeypatch.setattr(session_reader, "SESSION_BYTES", size)
    read_session(path)
    monkeypatch.setattr(session_reader, "SESSION_BYTES", size - 1)
    with pytest.raises(BadInput, match=f"has more than {size - 1} bytes"):
        read_session(path)


def test_a_session_of_schema_version_1_is_read_and_continued(run_events, path):
    current = read_session(path)
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    lines[0]["schema_version"] = 1
    for line in lines[1:]:
        for seen in line.get("event", {}).get("objects", ()):
            seen["called"] = seen.pop("display_name")
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")
    assert '"called"' in path.read_text(encoding="utf-8")
    old = read_session(path)
    assert old.lines == current.lines
    with SessionWriter(path, {}) as session:
        for event in run_events:
            session.on_event(event)
    both = [line.event for line in read_session(path).lines if line.event is not None]
    assert both == 2 * [line.event for line in current.lines if line.event is not None]


@pytest.mark.parametrize("spec, parts", [({"shape": "circle", "size": "small"}, 1), ({"shape": "heap"}, 0), (None, 0)])
def test_in_a_session_of_schema_version_2_what_was_read_is_a_goal_of_one_structure(path, spec, parts):
    lines = lines_of(path)
    lines[0]["schema_version"] = 2
    parsed = next(line["event"] for line in lines if line.get("event", {}).get("kind") == "parsed")
    for key in ("goal", "parts", "objects"):
        del parsed[key]
    parsed["spec"] = {"shape": None, "size": None, "x_position": None, "y_position": None, "rotation": None} | (
        spec or {}
    )
    if spec is None:
        parsed["spec"] = None
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")
    if spec is None:
        with pytest.raises(BadInput, match=r"parsed\.spec must be an object"):
            read_session(path)
        return
    read = next(line.event for line in read_session(path).lines if line.event and line.event["kind"] == "parsed")
    assert len(read["goal"]["parts"]) == parts and read["parts"] == [] == read["objects"]
    if parts:
        assert read["goal"]["parts"][0]["kind"] == "structure" and read["goal"]["parts"][0]["size"] == "small"


def test_a_session_of_schema_version_3_is_read_with_the_present_names_of_proposals(run_events, path):
    with SessionWriter(path, {}) as session:
        session.on_event(events.Failed("propose", "no candidate is worth trying", 4))
    current = read_session(path)
    lines = lines_of(path)
    for line in lines:
        if "schema_version" in line:
            line["schema_version"] = 3
        event, picture = line.get("event", {}), line.get("picture", {})
        for scored in [event, *(event.get("candidates") or ())]:
            if "scores" in scored:
                scored["scores"]["imagined"] = scored["scores"].pop("total")
        if event.get("kind") == "proposed":
            event["kind"] = "imagined"
        if event.get("step") == "propose":
            event["step"] = "imagination"
        if picture.get("name") == "proposed-goal":
            picture["name"] = "imagined-goal"
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    assert all(name in text for name in ('"imagined"', '"imagined-goal"', '"imagination"')) and "rollout" not in text
    read = read_session(path)
    assert [line.picture for line in read.lines] == [line.picture for line in current.lines]
    assert [line.event and line.event["kind"] for line in read.lines] == [
        line.event and line.event["kind"] for line in current.lines
    ]
    events_of = {line.event["kind"]: line.event for line in read.lines if line.event is not None}
    assert "rollout" in events_of["chosen"]["scores"] and events_of["failed"]["step"] == "propose"
    assert all("rollout" in one["scores"] for one in events_of["proposed"]["candidates"])


def test_a_session_of_this_version_needs_the_goal(path):
    lines = lines_of(path)
    del next(line["event"] for line in lines if line.get("event", {}).get("kind") == "parsed")["goal"]
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")
    with pytest.raises(BadInput, match=r"parsed\.goal is missing"):
        read_session(path)


def test_a_placement_of_an_earlier_version_stood(run_events):
    """Sessions up to version 5 neither said what fell nor counted objects."""
    placed = next(event for event in run_events if type(event).__name__ == "Placed").to_dict()
    seen = run_events[2].to_dict()
    old = {key: value for key, value in placed.items() if key not in ("trouble", "again", "on")}
    objects = [{key: value for key, value in one.items() if key != "number"} for one in seen["objects"]]
    assert payload_error(old) == "placed.trouble is missing"
    assert upgrade_payload(old, 5) == placed and payload_error(upgrade_payload(old, 5)) is None
    assert upgrade_payload({**seen, "objects": objects}, 5) == seen
