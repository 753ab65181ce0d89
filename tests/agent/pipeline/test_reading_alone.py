"""A text at which the program fails costs itself and no other, and is told with its kind and place."""

import io
import json
from types import SimpleNamespace

import pytest

from agent.cli.app import command_line
from agent.cli.evaluate.options import finish
from agent.evaluation.benchmark_instructions import read_instructions
from agent.evaluation.parsing import measure_parsing, print_parsing
from agent.pipeline.instruction_parser import ReadingOptions
from grounding.benchmark import free_rows
from grounding.parsers.llm_reply import LLMError
from grounding.propose.network import NetworkProposer

SENTENCE = "a defect of structagent, ZeroDivisionError: division by zero, at grounding/"


@pytest.fixture
def broken(monkeypatch):
    """Lets the program fail at every text with the word "zebra"."""
    propose = NetworkProposer.propose

    def fail(self, text, *arguments, **options):
        return 1 / 0 if "zebra" in text else propose(self, text, *arguments, **options)

    monkeypatch.setattr(NetworkProposer, "propose", fail)


@pytest.mark.parametrize("option", [[], ["--json"]])
def test_parse_reads_the_other_lines(broken, monkeypatch, capfd, option):
    lines = io.TextIOWrapper(io.BytesIO(b"stack the cans\nput the zebra on the left\nput the cups in a circle\n"))
    monkeypatch.setattr("sys.stdin", lines)
    assert command_line(["parse", *option]) == 1
    shown, told = capfd.readouterr()
    assert told.count(SENTENCE) == 1 and "Traceback" not in told
    if option:
        rows = [json.loads(line) for line in shown.splitlines()]
        assert [row["status"] for row in rows] == ["ok", "defect", "ok"] and rows[1]["message"].startswith(SENTENCE)
        assert rows[1]["goal"] == {"parts": []} and rows[1].keys() == rows[0].keys()
    else:
        assert "“put the zebra on the left”\n  not read\n“put the cups" in shown


def test_evaluations_count_it_as_wrong_and_say_so(broken, tmp_path, capfd):
    slots = tmp_path / "slots.jsonl"
    rows = (
        '{"text": "stack the cans", "shape": "tower"}',
        '{"text": "one zebra"}',
        '{"text": "hello", "refuse": true}',
    )
    slots.write_text("\n".join(rows))
    goals = tmp_path / "goals.jsonl"
    goals.write_text('{"text": "hello zebra", "scene": null, "status": "refused", "goals": []}\n')
    report = measure_parsing(["embedding"], [str(slots)], [str(goals)], None, ReadingOptions())
    assert [one["text"] for one in report["defects"]] == ["one zebra", "hello zebra"]
    assert all(one["message"].startswith(SENTENCE) for one in report["defects"])
    (found,), (read,) = report["evaluations"], report["goals"]
    assert (found["exact"]["hits"], [one["status"] for one in found["wrong"]]) == (2, ["defect"])
    assert read["exact"]["hits"] == 0
    with pytest.raises(Exception) as ended:
        finish(lambda: report, print_parsing, None, False)
    assert ended.value.exit_code == 1 and capfd.readouterr().err.count("was not read: " + SENTENCE) == 2


def test_the_sentences_of_evaluate_language_are_read_all_the_same(monkeypatch):
    propose = NetworkProposer.propose
    first, *others = [row for row in free_rows() if not row.refuse][:3]

    def fail(self, text, *arguments, **options):
        return 1 / 0 if text == first.text else propose(self, text, *arguments, **options)

    monkeypatch.setattr(NetworkProposer, "propose", fail)
    read, _ = read_instructions(list(enumerate([first, *others])), ReadingOptions())
    assert [one.parse.status == "defect" for one in read] == [True, False, False] and not read[0].understood
    assert read[0].parse.message.startswith("a defect of structagent, ZeroDivisionError")


def test_what_is_no_defect_ends_the_reading(monkeypatch):
    from agent.pipeline.reading_alone import read_alone

    def unreachable(texts, objects):
        raise LLMError("no answer")

    with pytest.raises(LLMError):
        read_alone(SimpleNamespace(interpret_many=unreachable), ["a", "b"], None, lambda one: one)
