"""The folder of a batch: nothing that was kept is lost or torn, and one batch at a time is at work in it."""

import json

import pytest

from agent.batch.results import RESULTS, Results
from agent.errors import BadInput, UsageError


def result(row_id: str, **more: object) -> dict:
    line = {"id": row_id, "line": 1, "fingerprint": "0", "success": True, "exit_code": 0, "report": None, "seconds": {}}
    return line | more


def test_results_are_found_again(tmp_path):
    with Results(tmp_path / "new" / "out") as results:
        results.add(result("a", message="“größer”"))
        results.add(result("b"))
    with Results(tmp_path / "new" / "out") as results:
        assert results.by_id == {"a": result("a", message="“größer”"), "b": result("b")}


def test_of_two_lines_with_one_id_the_later_holds(tmp_path):
    with Results(tmp_path) as results:
        results.add(result("a", success=False))
        results.add(result("a"))
    with Results(tmp_path) as results:
        assert results.by_id["a"]["success"]


def test_a_torn_last_line_is_dropped_wherever_it_is_torn(tmp_path):
    with Results(tmp_path) as results:
        results.add(result("a"))
        whole = results.path.read_bytes()
        results.add(result("b", message="größer"))
        both = results.path.read_bytes()
    for length in range(len(whole), len(both) + 1):
        (tmp_path / RESULTS).write_bytes(both[:length])
        with Results(tmp_path) as results:
            complete = length >= len(both) - 1  # but for the line's end, nothing is missing
            assert set(results.by_id) == ({"a", "b"} if complete else {"a"})
            assert (tmp_path / RESULTS).read_bytes() == (both if complete else whole)


def test_what_is_added_after_a_torn_line_stands_on_its_own(tmp_path):
    (tmp_path / RESULTS).write_text(json.dumps(result("a")) + '\n{"id": "b", "li')
    with Results(tmp_path) as results:
        results.add(result("c"))
    assert [json.loads(line)["id"] for line in (tmp_path / RESULTS).read_text().splitlines()] == ["a", "c"]


@pytest.mark.parametrize("content", ['{"id": "b"}\n{"id": "c"}\n', "some notes\nof mine\n"])
def test_a_file_of_somebody_else_is_left_alone(tmp_path, content):
    (tmp_path / RESULTS).write_text(content)
    with pytest.raises(BadInput, match="line 1: this is no result of a batch"):
        Results(tmp_path)
    assert (tmp_path / RESULTS).read_text() == content


def test_two_batches_in_one_folder(tmp_path):
    with Results(tmp_path):
        with pytest.raises(UsageError, match="another batch is at work"):
            Results(tmp_path)
    Results(tmp_path).close()


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "notes").write_text("")
    with pytest.raises(UsageError, match="--out must be a folder"):
        Results(tmp_path / "notes")


def test_a_report_is_moved_into_place_and_replaces_the_earlier_one(tmp_path):
    with Results(tmp_path) as results:
        for name in ("first", "second"):
            results.workplace("a").mkdir()
            (results.workplace("a") / f"{name}.html").write_text("")
            results.add(result("a", report=f"rows/a/{name}.html"))
            assert results.has_report(results.by_id["a"])
        assert [path.name for path in (tmp_path / "rows" / "a").iterdir()] == ["second.html"]
        results.add(result("a", success=False))
        assert not (tmp_path / "rows" / "a").exists()


def test_what_a_killed_batch_left_half_done_is_cleaned_up_and_reports_stay(tmp_path):
    (tmp_path / "rows" / ".b").mkdir(parents=True)
    (tmp_path / "rows" / "a").mkdir()
    with Results(tmp_path):
        assert [path.name for path in (tmp_path / "rows").iterdir()] == ["a"]


def test_results_in_order_replace_the_journal(tmp_path):
    with Results(tmp_path) as results:
        for row_id in "cab":
            results.add(result(row_id))
        results.arrange([results.by_id[row_id] for row_id in "ab"])
        results.add(result("d"))
    assert [json.loads(line)["id"] for line in (tmp_path / RESULTS).read_text().splitlines()] == ["a", "b", "d"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [".lock", RESULTS, "rows"]
