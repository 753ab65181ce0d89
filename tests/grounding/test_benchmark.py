"""The benchmark: its rows, its arithmetic, and that nothing of it is in the training text."""

import json
import re

import numpy as np
import pytest

from grounding import benchmark
from grounding.benchmark import (
    BenchmarkError,
    Row,
    development_rows,
    five_slots,
    free_rows,
    is_exact,
    load_rows,
    rate,
    score,
    templated_rows,
)
from grounding.corpus.grammar import all_sentences
from grounding.corpus.paraphrases import paraphrase
from grounding.corpus.templates import all_frames
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart
from grounding.parse_result import Parse, refusal
from grounding.spec import SLOTS, SLOTS_OF_SHAPE, StructureSpec
from prompts import load_prompt, prompt_lines, prompt_names

OPEN = dict.fromkeys(SLOTS, (None,))


def row(text="t", refuse=False, stratum="all", **values):
    return Row(text, OPEN | values, refuse, stratum)


def said(spec=StructureSpec(), status="ok", confidence=None):
    return Parse("t", spec, "p", status, confidence=confidence or {})


def test_the_free_benchmark_has_what_it_promises():
    rows = free_rows()
    strata = {found.stratum for found in rows}
    assert len(rows) >= 400 and strata == {
        "complete", "partial", "indirect", "viewpoint", "negation", "typos", "long-winded", "distracting",
        "out of scope", "object selection",
    }  # fmt: skip
    assert len({found.text for found in rows}) == len(rows)
    for found in rows:
        assert found.refuse == (found.stratum == "out of scope")
        if found.refuse:
            assert dict(found.acceptable) == OPEN
        shape = found.acceptable["shape"][0]
        for slot in SLOTS[1:]:
            assert found.acceptable[slot][0] is None or slot in SLOTS_OF_SHAPE[shape], found.text
        assert (found.objects is not None) == (found.stratum == "object selection")


def _plain(text):
    return " ".join(re.findall(r"\w+", text.lower()))


def test_training_text_never_contains_a_sentence_of_the_benchmark():
    held_out = {_plain(found.text) for found in (*free_rows(), *development_rows())}
    fixed = {
        _plain("".join(piece for piece in frame.pieces if isinstance(piece, str)))
        for frames in all_frames().values()
        for frame in frames
        if not frame.holes
    }
    assert len(fixed) > 300 and not fixed & held_out
    rng = np.random.default_rng(11)
    drawn = {_plain(paraphrase(rng).text) for _ in range(20_000)}
    assert not drawn & held_out
    assert not {_plain(text) for text, _ in all_sentences()} & held_out
    shown = {_plain(text) for name in prompt_names() for text, _ in prompt_lines(load_prompt(name))}
    assert shown and not shown & held_out


def test_templated_rows_have_both_held_out_splits():
    rows = templated_rows()
    counts = {name: sum(found.stratum == name for found in rows) for name in {found.stratum for found in rows}}
    assert len(rows) == len(all_sentences())
    assert set(counts) == {"seen", "held-out template", "held-out combination"} and min(counts.values()) > 500


def test_a_fair_reading_is_right_and_another_is_not():
    found = row(x_position=("center", None), y_position=(None, "middle"))
    assert is_exact(found, said(StructureSpec(x_position="center")))
    assert is_exact(found, said(StructureSpec(y_position="middle")))
    assert not is_exact(found, said(StructureSpec(x_position="left")))
    assert not is_exact(found, refusal("t", "idle", "p"))
    assert is_exact(row(refuse=True), refusal("t", "idle", "p"))
    assert not is_exact(row(refuse=True), said(status="ask"))


def test_rates_by_hand():
    rows = [
        row(shape=("circle",), stratum="a"),
        row(shape=("line",), size=("small", None), stratum="a"),
        row(refuse=True, stratum="b"),
        row(refuse=True, stratum="b"),
        row(shape=("tower",), stratum="b"),
    ]
    parses = [
        said(StructureSpec("circle"), confidence=dict.fromkeys(SLOTS, 0.8)),
        said(StructureSpec("line", x_position="left"), confidence=dict.fromkeys(SLOTS, 0.8)),
        refusal("t", "idle", "p"),
        said(StructureSpec("circle")),
        refusal("t", "idle", "p"),
    ]
    found = score(rows, parses)
    assert found["exact"]["hits"] == 2 and found["exact"]["n"] == 5
    assert found["slots"]["shape"]["rate"] == 1.0 and found["slots"]["x_position"]["rate"] == 0.5
    # Of the two that were read: four open slots in the first, three that must be open in the second.
    assert (found["false_fills"]["hits"], found["false_fills"]["n"]) == (1, 7)
    assert found["refusal"]["precision"]["rate"] == 0.5 and found["refusal"]["recall"]["rate"] == 0.5
    assert found["strata"]["a"]["rate"] == 0.5 and found["strata"]["b"]["hits"] == 1
    # Nine of ten slots are right at 0.8: off by 0.1.
    assert found["calibration_error"] == pytest.approx(0.1)
    assert found["confusion"]["x_position"]["open"] == {"left": 1, "center": 0, "right": 0, "open": 1}
    assert len(found["wrong"]) == 3
    json.dumps(found)


def test_wilson_interval():
    found = rate(81, 100)  # Brown, Cai, DasGupta 2001: centre (x + z^2/2) / (n + z^2)
    z = 1.959964
    centre = (81 + z * z / 2) / (100 + z * z)
    assert (found["low"] + found["high"]) / 2 == pytest.approx(centre, abs=1e-6)
    assert rate(0, 0)["rate"] is None


def test_without_confidences_there_is_no_calibration_error():
    assert score([row()], [said()])["calibration_error"] is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{", "line 2 is not valid JSON"),
        ('{"shape": ["line"]}', "line 2 has no text"),
        (
            '{"text": "t", "shape": ["heart"]}',
            "shape cannot be 'heart'; legal values: circle, line, tower, table setting, cluster, .*, pyramid, null",
        ),
        ('{"text": "t", "size": []}', "size lists no acceptable value"),
        ('{"text": "t", "refuse": "yes"}', "refuse must be true or false, not 'yes'"),
        ('{"text": "t", "scene": ["mug"], "objects": [1]}', r"objects must be indices below 1, not \[1\]"),
    ],
)
def test_a_row_that_cannot_be_used(tmp_path, line, message):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"text": "a row", "shape": "line"}\n' + line + "\n")
    with pytest.raises(BenchmarkError, match=message):
        load_rows(path)


def test_files_that_are_none(tmp_path):
    (tmp_path / "empty").write_text("\n")
    with pytest.raises(BenchmarkError, match="has no row"):
        load_rows(tmp_path / "empty")
    for content, why in ((b"\xe9t\xe9", "is not UTF-8"), (b"\xff\xfe\x00", "begins like UTF-16-LE text")):
        (tmp_path / "bytes").write_bytes(content)
        with pytest.raises(BenchmarkError, match=why):
            load_rows(tmp_path / "bytes")
    with pytest.raises(OSError, match="missing"):
        load_rows(tmp_path / "missing")


def test_a_file_without_an_end_and_one_of_lists_in_lists(tmp_path, monkeypatch):
    monkeypatch.setattr(benchmark, "MOST_BYTES", 100_000)
    (tmp_path / "endless.jsonl").symlink_to("/dev/zero")
    with pytest.raises(BenchmarkError, match="has more than 100000 bytes"):
        load_rows(tmp_path / "endless.jsonl")
    (tmp_path / "deep.jsonl").write_text("[" * 90_000)
    with pytest.raises(BenchmarkError, match="deep.jsonl begins like JSON, but cannot be read as JSON"):
        load_rows(tmp_path / "deep.jsonl")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_rows_of_an_array_and_in_other_encodings(tmp_path, encoding):
    row = '{"text": "a row", "shape": "line"}'
    (tmp_path / "rows.jsonl").write_text(row + "\n" + row, encoding=encoding)
    (tmp_path / "rows.json").write_text(f"[{row},\n{row}]", encoding=encoding)
    assert load_rows(tmp_path / "rows.jsonl") == load_rows(tmp_path / "rows.json")
    (tmp_path / "rows.json").write_text(f'[{row}, {{"text": 3}}]', encoding=encoding)
    with pytest.raises(BenchmarkError, match="rows.json, row 2 has no text"):
        load_rows(tmp_path / "rows.json")


def test_a_goal_that_five_slots_cannot_hold_counts_as_refused():
    cups = Parse("t", StructureSpec("circle"), "p")
    plain = Goal((StructurePart("circle", objects=(0, 1, 2)),))
    assert five_slots(cups, "ok", plain) == cups
    larger = [
        (StructurePart("circle", radius=0.1),),
        (StructurePart("circle", objects=(0, 1, 2)), StructurePart("tower", objects=(3, 4))),
        (RelationPart("on", (0,), (1,)),),
    ]
    for parts in larger:
        found = five_slots(cups, "ok", Goal(parts))
        assert found.status == "refused" and found.spec == StructureSpec()
        assert is_exact(row(refuse=True), found) and not is_exact(row(shape=("circle",)), found)
    assert not is_exact(row(refuse=True), five_slots(cups, "ok", plain))


def test_a_line_along_an_edge_is_a_line_on_that_side():
    line = Goal((StructurePart("line", size="large", along="far"),))
    found = five_slots(Parse("t", StructureSpec("line"), "p"), "ok", line)
    assert found.status == "ok" and found.spec == StructureSpec("line", "large", y_position="top")
    spaced = Goal((StructurePart("line", along="far", gap=0.05),))
    assert five_slots(Parse("t", StructureSpec("line"), "p"), "ok", spaced).status == "refused"


def test_the_status_of_the_whole_reading_counts():
    cups = Parse("t", StructureSpec("circle"), "p")
    assert five_slots(cups, "refused", Goal()).status == "refused"
    asked = five_slots(cups, "ask", Goal())
    assert asked.status == "ask" and asked.spec == cups.spec


def test_a_question_that_offers_no_plain_goal_is_no_plain_reading():
    cups, plain = Parse("t", StructureSpec("circle"), "p"), Goal((StructurePart("circle", objects=(0, 1, 2)),))
    larger = Goal((RelationPart("on", (0,), (1,)),))
    assert five_slots(cups, "ask", Goal(), (larger,)).status == "refused"
    assert five_slots(cups, "ask", Goal(), (larger, plain)).status == "ask"
