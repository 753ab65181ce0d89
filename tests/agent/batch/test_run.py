"""`structagent batch` as people use it: killed, interrupted, resumed, with broken rows, by any number of workers."""

import json
import os
import random
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
import trimesh

from agent.cli.app import command_line
from agent.pipeline import film
from tests.commands import structagent

ROOT = Path(__file__).parents[3]
FLAGS = ("--objects", "boxes", "--model", "geometric", "--workers")
BROKEN = {
    3: (6, '{"text": "stack two boxes"'),
    5: (6, '{"txet": "stack two boxes"}'),
    6: (6, '{"text": "stack two boxes", "seed": "7"}'),
    8: (2, '{"text": "stack two boxes", "model": "oracle"}'),
    11: (6, '{"text": "stack two boxes", "id": "row-1"}'),
}  # line -> exit code and text


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch) -> Path:
    """The current folder, with a folder of two boxes."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "boxes").mkdir()
    for number in range(2):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(tmp_path / "boxes" / f"box_{number}.stl")
    return tmp_path


def row(text: str, **more: object) -> str:
    return json.dumps({"text": text} | more)


def write(name: str, *rows: str) -> None:
    Path(name).write_text("\n".join(rows) + "\n")


def results_of(out: str) -> list[dict]:
    return [json.loads(line) for line in (Path(out) / "results.jsonl").read_text(encoding="utf-8").splitlines()]


def timeless(value: object) -> object:
    """`value` without what says how long something took."""
    if isinstance(value, dict):
        return {key: timeless(entry) for key, entry in value.items() if key != "seconds"}
    return [timeless(entry) for entry in value] if isinstance(value, list) else value


FILM_INTERVAL = film.INTERVAL


def reports_of(out: str) -> dict[str, object]:
    folders = (Path(out) / "rows").iterdir()
    return {folder.name: timeless(json.loads((folder / "report.json").read_text())) for folder in folders}


class Batch:
    """A batch in a process of its own, in a session of its own."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            structagent("batch", *arguments),
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # Whoever runs the tests in the background ignores Ctrl-C, and so would everything that they start.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )

    def wait_for(self, results: int, out: str) -> None:
        """Until so many whole lines are in the journal."""
        path = Path(out) / "results.jsonl"
        while not path.exists() or path.read_bytes().count(b"\n") < results:
            assert self.process.poll() is None, self.process.communicate()
            time.sleep(0.01)

    def end(self) -> tuple[int, str, str]:
        """Exit code, output and errors. Both streams close when the last process that has them is gone: no orphans."""
        out, err = self.process.communicate()
        return self.process.returncode, out, err


def test_killed_three_times_and_resumed_it_ends_as_if_undisturbed():
    rows = [row("stack two boxes", id=f"row-{line}", seed=line) for line in range(1, 12)]
    rows[6] = row("stack two boxes on the left", model="diffusion")
    rows[9] = row("line up two boxes", model="diffusion", seed=4)
    for line, (_, text) in BROKEN.items():
        rows[line - 1] = text
    write("orders.jsonl", *rows)
    code, table, _ = Batch("orders.jsonl", "--out", "undisturbed", "--no-execute", *FLAGS, "2").end()
    undisturbed = results_of("undisturbed")
    assert code == 6 and "bad input" in table
    assert [result["line"] for result in undisturbed] == list(range(1, 12))
    assert {result["line"]: result["exit_code"] for result in undisturbed if result["exit_code"]} == {
        line: code for line, (code, _) in BROKEN.items()
    }

    chance = random.Random()
    moments = sorted(len(BROKEN) + count for count in chance.sample(range(1, 5), 3))
    print("killed at", moments)
    for moment in moments:
        batch = Batch("orders.jsonl", "--out", "killed", "--no-execute", *FLAGS, "2")
        batch.wait_for(moment, "killed")
        time.sleep(chance.uniform(0, 0.5))
        batch.process.kill()
        assert batch.end()[0] == -signal.SIGKILL
    before = {result["id"]: result for result in results_of("killed")}
    assert len(before) == len(results_of("killed")) >= moments[-1]
    code, _, _ = Batch("orders.jsonl", "--out", "killed", "--no-execute", *FLAGS, "2").end()
    after = results_of("killed")
    assert code == 6
    assert timeless(after) == timeless(undisturbed)
    assert reports_of("killed") == reports_of("undisturbed") and len(reports_of("killed")) == 6
    kept = {result["id"]: result for result in after if result["id"] in before}
    assert kept == before  # seconds too: nothing was done twice


def test_interrupted_it_keeps_what_has_ended_and_leaves_nobody_behind():
    write("orders.txt", *["stack two boxes"] * 30)
    batch = Batch("orders.txt", "--out", "out", "--no-execute", *FLAGS, "2")
    batch.wait_for(2, "out")
    os.killpg(batch.process.pid, signal.SIGINT)  # as Ctrl-C does
    code, out, err = batch.end()
    assert code == 130 and err.endswith("structagent: interrupted\n") and "Traceback" not in err
    results = results_of("out")
    assert out == "" and 2 <= len(results) < 30 and all(result["success"] for result in results)
    assert {path.name for path in Path("out/rows").iterdir()} == {result["id"] for result in results}
    page = Path("out/index.html").read_text(encoding="utf-8")
    assert page.count('class="stood"') == len(results) and page.count('class="waiting"') == 30 - len(results)


@pytest.mark.usefixtures("in_this_process", "small_drawings")
def test_again_it_does_what_is_missing_or_has_changed(capsys):
    rows = [row("stack two boxes", id=name, seed=1) for name in ("same", "edited", "lost", "dropped")]
    write("orders.jsonl", *rows, row("fly to the moon", id="moon"))
    arguments = ["batch", "orders.jsonl", "--out", "out", "--no-execute", *FLAGS, "1"]
    assert command_line(arguments) == 3
    assert "fly to the moon" in capsys.readouterr().out
    first = {result["id"]: result for result in results_of("out")}
    (Path("out") / first["lost"]["report"]).unlink()
    edited = row("stack two boxes", id="edited", seed=2)
    write("orders.jsonl", row("fly to the moon", id="moon"), rows[0], edited, rows[2])
    assert command_line([*arguments, "--json"]) == 3
    output = json.loads(capsys.readouterr().out)
    assert (output["rows"], output["succeeded"], output["kept"], output["exit_code"]) == (4, 3, 2, 3)
    assert output["outcomes"] == {"0": 3, "3": 1} and output["shapes"]["tower"]["rows"] == 3
    assert [(failure["id"], failure["line"], failure["step"]) for failure in output["failures"]] == [
        ("moon", 1, "parse")
    ]
    second = {result["id"]: result for result in results_of("out")}
    assert list(second) == ["moon", "same", "edited", "lost"]
    assert second["same"] == first["same"] | {"line": 2}
    assert second["edited"]["seed"] == 2 and second["edited"]["fingerprint"] != first["edited"]["fingerprint"]
    assert second["lost"]["seconds"] != first["lost"]["seconds"] and Path("out", second["lost"]["report"]).is_file()
    assert Path("out", first["dropped"]["report"]).is_file()  # a report is never thrown away with its row
    page = Path("out/index.html").read_text(encoding="utf-8")  # is that of the rows that the file has now
    assert re.findall(r'<li id="row-(\w+)" class="(\w+)"', page) == [
        ("moon", "refused"), ("same", "stood"), ("edited", "stood"), ("lost", "stood")
    ]  # fmt: skip


def beginning(err: str) -> str:
    """What is said first, but for what libraries say."""
    return next(line for line in err.splitlines() if " to do" in line)


@pytest.mark.usefixtures("in_this_process", "small_drawings")
def test_a_finished_batch_called_again_has_nothing_to_do(capsys):
    write("orders.jsonl", row("stack two boxes", id="a"))
    arguments = ["batch", "orders.jsonl", "--out", "out", "--no-execute", *FLAGS, "1"]
    assert command_line(arguments) == 0
    assert beginning(capsys.readouterr().err) == "1 row: 1 to do"
    before = results_of("out")
    assert command_line(arguments) == 0
    assert beginning(capsys.readouterr().err) == "1 row: 1 done before and kept, 0 to do"
    assert results_of("out") == before


def test_a_batch_whose_rows_are_all_bad(capsys):
    write("orders.jsonl", '{"txet": "stack two boxes"}', '{"text": "stack two boxes", "model": "oracle"}')
    arguments = ["batch", "orders.jsonl", "--out", "out", *FLAGS, "1"]
    assert command_line(arguments) == 6
    err = capsys.readouterr().err
    assert "1 of 2: line-001 failed: bad input\n2 of 2: line-002 failed: wrong usage\n" in err
    assert [result["exit_code"] for result in results_of("out")] == [6, 2]
    assert command_line(arguments) == 6
    again = capsys.readouterr().err
    assert beginning(again) == "2 rows: 2 failed before and kept (--retry tries them again), 0 to do"
    assert "1 of 2" not in again


@pytest.mark.usefixtures("in_this_process", "small_drawings")
def test_what_failed_is_kept_unless_it_is_to_be_tried_again_and_what_was_lost_is_not(capsys):
    write("orders.jsonl", row("stack two boxes", id="built"), row("fly to the moon", id="moon"), '{"txet": 1}')
    arguments = ["batch", "orders.jsonl", "--out", "out", "--no-execute", *FLAGS, "1"]
    assert command_line(arguments) == 6
    said = capsys.readouterr().err
    assert beginning(said) == "3 rows: 3 to do"
    assert "1 of 3: line-003 failed: bad input\n" in said
    assert "3 of 3: moon failed: not understood or not buildable, " in said
    assert command_line(arguments) == 6
    known = "1 done before and kept, 2 failed before and kept (--retry tries them again), 0 to do"
    assert beginning(capsys.readouterr().err) == f"3 rows: {known}"
    assert command_line([*arguments, "--retry"]) == 6
    said = capsys.readouterr().err
    assert beginning(said) == "3 rows: 1 done before and kept, 2 to do"
    assert "2 of 2: moon failed: not understood or not buildable, " in said and "built done" not in said

    lost = {"success": False, "exit_code": 1, "step": "crash", "message": "worker died (SIGKILL)"}
    results = [result | (lost if result["id"] == "built" else {}) for result in results_of("out")]
    Path("out/results.jsonl").write_text("".join(json.dumps(result) + "\n" for result in results))
    assert command_line(arguments) == 6
    said = capsys.readouterr().err
    assert beginning(said) == "3 rows: 2 failed before and kept (--retry tries them again), 1 to do"
    assert "1 of 1: built done, " in said and results_of("out")[0]["success"]


@pytest.mark.usefixtures("in_this_process", "small_drawings")
def test_the_page_shows_every_row(capsys):
    instructions = {"built": "stack <two> boxes", "moon": "fly to the moon", "which": "put the boxes"}
    write("orders.jsonl", *(row(text, id=name) for name, text in instructions.items()), '{"txet": 1}')
    assert command_line(["batch", "orders.jsonl", "--out", "out", "--no-execute", *FLAGS, "1"]) == 6
    assert "\npage: out/index.html\n" in capsys.readouterr().out
    page = Path("out/index.html").read_text(encoding="utf-8")
    cards = dict(re.findall(r'<li id="row-([^"]+)" (class="\w+".*)</li>', page))
    assert list(cards) == ["built", "moon", "which", "line-004"]
    result = results_of("out")[0]
    assert cards["built"].startswith('class="stood" data-outcome="stood" data-structures="tower">')
    assert "“stack &lt;two&gt; boxes”" in cards["built"] and f"{result['seconds']['total']:.1f} s" in cards["built"]
    assert f"passed all {len(result['checks'])} checks" in cards["built"]
    linked = re.findall(r'(?:src|href)="([^#"]+)"', cards["built"])
    pictures = ["camera-before", "goal-overlay", "camera-tried"]
    assert set(linked) == {"rows/built/report.html", *(f"rows/built/{name}.webp" for name in pictures)}
    assert all((Path("out") / name).is_file() for name in linked)
    assert cards["moon"].startswith('class="refused"') and "does not ask for an arrangement" in cards["moon"]
    assert cards["which"].startswith('class="asked"') and "which shape should it be" in cards["which"]
    assert cards["line-004"].startswith('class="failed"') and "the key &quot;txet&quot; is unknown" in cards["line-004"]
    assert 'href="#row-moon"' in page and "http" not in page  # it needs nothing but what lies beside it


def test_results_follow_from_the_seed_whoever_works_and_in_whatever_order(request):
    rows = [row("stack two boxes", id="a"), row("line up two boxes", id="b", seed=2)]
    write("forth.jsonl", *rows)
    write("back.jsonl", *rows[::-1])
    assert command_line(["batch", "forth.jsonl", "--out", "forth", *FLAGS, "2"]) == 0
    request.getfixturevalue("in_this_process")
    # The films of tests are short in this process, and not in that of a command.
    request.getfixturevalue("monkeypatch").setattr("agent.pipeline.film.INTERVAL", FILM_INTERVAL)
    assert command_line(["batch", "back.jsonl", "--out", "back", *FLAGS, "1"]) == 0
    assert reports_of("forth") == reports_of("back")
    assert all(report["verdict"]["how"] == "arm" for report in reports_of("forth").values())


@pytest.mark.parametrize(
    ("arguments", "code", "part"),
    [
        (["orders.txt", "--out", "out"], 6, "there is no batch file 'orders.txt'"),
        (["boxes/box_0.stl"], 2, "--out"),
        (["given.txt", "--out", "given.txt"], 2, "--out must be a folder"),
        (["given.txt", "--out", "out", "--workers", "0"], 2, "--workers"),
        (["given.txt", "--out", "out", "--model", "oracle"], 2, "--model cannot be 'oracle'"),
    ],
)
def test_a_batch_that_cannot_begin(arguments, code, part, capsys):
    write("given.txt", "make a line")
    assert command_line(["batch", *arguments]) == code
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("structagent: ")]
    assert len(said) == 1 and part in said[0]
    assert not Path("out").exists()
