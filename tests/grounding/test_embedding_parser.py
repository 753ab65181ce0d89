"""The trained parser: what it understands, what it refuses, and how sure it says it is."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from grounding.corpus import all_sentences
from grounding.embedding_parser import WEIGHTS, EmbeddingParser, ParseError, ParserWeightsError, _make_legal
from grounding.paraphrases import LabelledText, paraphrase
from grounding.slot_reader import SlotReader
from grounding.spec import SLOTS, StructureSpec
from grounding.train_parser import calibrate, encode, read, train

HERE = Path(__file__).parent


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        ("put the cups in a small circle on the left", StructureSpec("circle", "small", "left")),
        ("Put the small cups in a circle on the left!", StructureSpec("circle", None, "left")),
        ("set the table", StructureSpec("table setting")),
        ("stack the cans close to me", StructureSpec("tower", None, None, "bottom")),
        ("a long row facing north at the back", StructureSpec("line", "large", None, "top", "north")),
        ("line up all the mugs facing me", StructureSpec("line", rotation="south")),
        ("put everything on the right", StructureSpec(x_position="right")),
    ],
)
def test_instructions(parser, text, spec):
    parse = parser.parse(text)
    assert parse.spec == spec
    assert parse.text == text and parse.parser == "embedding" and not parse.dropped


def test_the_evidence_is_the_telling_word(parser):
    evidence = parser.parse("put the cups in a small circle on the left, facing east").evidence
    assert evidence["shape"] == ("circle",)
    assert evidence["size"] == ("small",)
    assert evidence["x_position"] == ("left",)
    assert "east" in evidence["rotation"]
    assert set(evidence) == {"shape", "size", "x_position", "rotation"}


def test_every_slot_has_a_confidence(parser):
    parse = parser.parse("a small circle")
    assert tuple(parse.confidence) == SLOTS
    assert all(0.0 < value <= 1.0 for value in parse.confidence.values())
    assert parse.confidence["shape"] > 0.8
    # a word that it hardly knows makes it less sure
    assert parser.parse("a crcle of cups").confidence["shape"] < parse.confidence["shape"]


def test_letter_case_says_nothing(parser):
    lower, upper = parser.parse("a large ring in the middle"), parser.parse("A LARGE RING IN THE MIDDLE")
    assert lower.spec == upper.spec and lower.confidence == upper.confidence


def test_what_a_shape_cannot_carry_is_dropped_and_told(parser):
    parse = parser.parse("build a small tower of cans on the left facing north")
    assert parse.spec == StructureSpec("tower", x_position="left")
    assert parse.dropped == {"size": "small", "rotation": "north"}
    assert set(parse.evidence) == {"shape", "x_position"}


def test_the_less_certain_of_two_gives_way():
    heard = {"shape": "tower", "size": "small", "x_position": "left", "y_position": None, "rotation": None}
    sure = dict.fromkeys(SLOTS, 0.9)
    assert StructureSpec(**_make_legal(heard, sure)) == StructureSpec("tower", x_position="left")
    assert StructureSpec(**_make_legal(heard, sure | {"shape": 0.4})) == StructureSpec(None, "small", "left")


@pytest.mark.parametrize("text", ["", "   \n\t"])
def test_an_empty_instruction(parser, text):
    with pytest.raises(ParseError, match="the instruction is empty"):
        parser.parse(text)


@pytest.mark.parametrize("text", ["hello", "pick up the mug", "what a lovely day", "?!", "☕☕", "12345"])
def test_nothing_understood(parser, text):
    with pytest.raises(ParseError, match=r"not understood: .*say a shape \(circle, line, tower, table "):
        parser.parse(text)


@pytest.mark.parametrize("shape", ["square", "triangle", "heart", "pyramid", "star"])
def test_a_shape_that_cannot_be_built(parser, shape):
    message = rf"cannot build '.*{shape}.*shapes that can be built: circle, line, tower, table setting"
    with pytest.raises(ParseError, match=message):
        parser.parse(f"put the cups in a {shape} on the left")


def test_a_square_box_is_no_square(parser):
    assert parser.parse("put the square boxes in a line").spec == StructureSpec("line")


def test_a_text_that_is_too_long_is_refused_and_not_cut(parser):
    with pytest.raises(ParseError, match=r"too long: 1\d{4} characters"):
        parser.parse("put the cups in a circle and then some more cups " * 205 + "on the left")


def _right(parser, name):
    """(right, all) of a file of sentences."""
    rows = [json.loads(line) for line in (HERE / name).read_text().splitlines()]
    right = 0
    for row in rows:
        try:
            found = parser.parse(row["text"]).spec
        except ParseError:
            right += row.get("refused", False)
            continue
        right += not row.get("refused") and found == StructureSpec.from_dict(
            {slot: row[slot] for slot in SLOTS if slot in row}
        )
    return right, len(rows)


def test_free_sentences(parser):
    """The first file was looked at while the parser was made, the second was not."""
    right, total = _right(parser, "free_sentences.jsonl")
    assert total == 42 and right >= 37
    right, total = _right(parser, "unseen_sentences.jsonl")
    assert total == 34 and right >= 30


def test_the_corpus_is_read_without_a_mistake_nearly_always(parser):
    table = all_sentences()
    chosen = np.random.default_rng(5).choice(len(table), 200, replace=False)
    right = sum(parser.parse(table[i][0]).spec == table[i][1] for i in chosen)
    assert right >= 190


def test_training_learns_and_calibration_lowers_the_loss(encoder):
    rng = np.random.default_rng(3)
    known = encode(encoder, [paraphrase(rng) for _ in range(512)])
    fresh = encode(encoder, [paraphrase(rng, held_out=True) for _ in range(128)])
    reader = train(known, seed=0)
    logits = read(reader, fresh)
    before = read(SlotReader().eval(), fresh)
    temperatures = calibrate(logits, fresh.answers)
    for i, slot in enumerate(SLOTS):
        loss = torch.nn.functional.cross_entropy
        assert loss(logits[i], fresh.answers[:, i]) < loss(before[i], fresh.answers[:, i])
        scaled = loss(logits[i] / temperatures[slot], fresh.answers[:, i])
        assert scaled <= loss(logits[i], fresh.answers[:, i]) + 1e-3
    same = read(train(known, seed=0), fresh)
    assert all(torch.equal(a, b) for a, b in zip(logits, same, strict=True))


def test_padding_changes_nothing(encoder):
    pair = ("a line", "a very long line of cups on the left")
    texts = [LabelledText(text, dict.fromkeys(SLOTS)) for text in pair]
    reader = SlotReader().eval()
    together = read(reader, encode(encoder, texts))
    alone = read(reader, encode(encoder, texts[:1]))
    for a, b in zip(together, alone, strict=True):
        torch.testing.assert_close(a[:1], b, atol=2e-3, rtol=0)


def test_training_never_draws_a_held_out_phrase():
    rng = np.random.default_rng(0)
    texts = " ".join(paraphrase(rng).text.lower() for _ in range(3000))
    assert "vertical pile" in texts
    assert not any(phrase in texts for phrase in ("loop", "lineup", "towering stack", "atop one another"))


@pytest.fixture
def copy(tmp_path):
    for name in ("config.json", "model.safetensors"):
        shutil.copy(WEIGHTS / name, tmp_path / name)
    return tmp_path


def test_weights_that_do_not_fit_are_told(copy, encoder):
    config = json.loads((copy / "config.json").read_text())
    (copy / "config.json").write_text(json.dumps(config | {"hidden": 32}))
    with pytest.raises(ParserWeightsError, match=r"do not fit: .*size mismatch"):
        EmbeddingParser.from_pretrained(copy, encoder)
    (copy / "config.json").write_text(json.dumps(config | {"encoder_sha256": "0" * 64}))
    with pytest.raises(ParserWeightsError, match=r"was trained on the encoder 0{12}\.\.\., not on 53aa51172d14"):
        EmbeddingParser.from_pretrained(copy, encoder)
    (copy / "model.safetensors").unlink()
    with pytest.raises(ParserWeightsError, match="model.safetensors is missing"):
        EmbeddingParser.from_pretrained(copy, encoder)


def test_the_weights_are_small():
    assert sum(path.stat().st_size for path in WEIGHTS.iterdir()) < 2_000_000
