"""Kept replies: found again by model, prompt and text, whatever happened to the file."""

import json

import pytest

from grounding.parsers.llm import LLMParser
from grounding.parsers.llm_cache import ReplyCache
from grounding.parsers.llm_reply import ANSWERS, LLMError, certain

REPLY = certain({question: answers[0] for question, answers in ANSWERS.items()})
OTHER = certain({question: answers[-1] for question, answers in ANSWERS.items()})


class Counting:
    """A model that always says the same, and counts how often."""

    gives_probabilities = False

    def __init__(self, identity="a model"):
        self.identity = identity
        self.asked = 0

    def ask(self, prompt, text):
        self.asked += 1
        return REPLY


def test_a_reply_is_found_again_by_another_process(tmp_path):
    cache = ReplyCache(tmp_path / "new" / "replies.jsonl")
    assert cache.get("m", "p", "t") is None
    cache.put("m", "p", "t", REPLY)
    again = ReplyCache(cache.path)
    assert again.get("m", "p", "t") == REPLY
    assert [again.get(*key) for key in (("n", "p", "t"), ("m", "q", "t"), ("m", "p", "u"))] == [None] * 3


def test_a_torn_last_line_costs_that_reply_only(tmp_path):
    cache = ReplyCache(tmp_path / "replies.jsonl")
    cache.put("m", "p", "first", REPLY)
    cache.put("m", "p", "torn", REPLY)
    cache.path.write_bytes(cache.path.read_bytes()[:-20])
    after = ReplyCache(cache.path)
    assert after.get("m", "p", "first") == REPLY and after.get("m", "p", "torn") is None
    after.put("m", "p", "next", OTHER)
    assert ReplyCache(cache.path).get("m", "p", "next") == OTHER
    assert ReplyCache(cache.path).get("m", "p", "first") == REPLY


def test_lines_that_are_no_legal_replies_are_passed_over(tmp_path):
    cache = ReplyCache(tmp_path / "replies.jsonl")
    cache.put("m", "p", "good", REPLY)
    entry = json.loads(cache.path.read_text())
    broken = [
        "[]", "null", "\x00", '{"key": 1}', "9" * 5000,
        json.dumps(entry | {"reply": entry["reply"] | {"shape": {"square": 1.0}}}),
        json.dumps(entry | {"reply": entry["reply"] | {"size": dict.fromkeys(ANSWERS["size"], 0.0)}}),
        json.dumps({key: value for key, value in entry.items() if key != "reply"}),
    ]  # fmt: skip
    cache.path.write_text("\n".join([*broken, json.dumps(entry | {"key": "of something else"})]) + "\n")
    assert len(ReplyCache(cache.path)) == 1


def test_the_parser_asks_the_model_once_for_a_text(tmp_path):
    path = tmp_path / "replies.jsonl"
    model = Counting()
    first = LLMParser(model, cache=ReplyCache(path)).parse("a ring")
    replayed = LLMParser(model, cache=ReplyCache(path)).parse("a ring")
    assert model.asked == 1 and replayed == first
    LLMParser(model, prompt="another prompt", cache=ReplyCache(path)).parse("a ring")
    LLMParser(Counting("another"), cache=ReplyCache(path)).parse("a ring")
    assert model.asked == 2 and len(ReplyCache(path)) == 3


def test_files_that_cannot_be_used_are_named(tmp_path):
    with pytest.raises(LLMError, match="cannot be read"):
        ReplyCache(tmp_path)
    (tmp_path / "file").write_text("")
    cache = ReplyCache(tmp_path / "replies.jsonl")
    cache.path = tmp_path / "file" / "replies.jsonl"
    with pytest.raises(LLMError, match="cannot be written"):
        cache.put("m", "p", "t", REPLY)
