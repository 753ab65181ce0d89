"""What a model says is told from what it thinks, in every spelling in which servers hand on thoughts."""

import gzip
import json

import pytest

from grounding.parsers.llm_completion import CompletionError, read_completion, split_thoughts

DRAFT, GOOD = '{"size": "large"}', '{"size": "small"}'


@pytest.mark.parametrize(
    "said",
    [
        GOOD,
        f"<think>\nperhaps {DRAFT}? no\n</think>\n\n{GOOD}",
        f"perhaps {DRAFT}? no\n</think>\n{GOOD}",
        f"<thinking>{DRAFT}</thinking>{GOOD}",
        f"<THINK>{DRAFT}</THINK>{GOOD}",
        f"<thought>{DRAFT}</thought>{GOOD}",
        f"<reasoning>{DRAFT}</reasoning>{GOOD}",
        f"<seed:think>{DRAFT}</seed:think>{GOOD}",
        f"[THINK]{DRAFT}[/THINK]{GOOD}",
        f"◁think▷{DRAFT}◁/think▷{GOOD}",
        f"<|START_THINKING|>{DRAFT}<|END_THINKING|>{GOOD}",
        f"<|begin_of_thought|>{DRAFT}<|end_of_thought|>{GOOD}",
        f"<think>one</think><think>{DRAFT}</think>{GOOD}",
        f"<think>a tag </think> inside, {DRAFT}</think>{GOOD}",
        f"<think>{DRAFT}</think>{GOOD}<think>was that right? {DRAFT}",
        f"<|channel|>analysis<|message|>{DRAFT}<|end|><|start|>assistant<|channel|>final<|message|>{GOOD}<|return|>",
        f"analysisThe user wants {DRAFT}assistantfinal{GOOD}",
        f"<|channel>thought\n{DRAFT}\n<channel|>{GOOD}",
    ],
)
def test_thoughts_are_dropped_up_to_their_end(said):
    assert split_thoughts(said)[1] == GOOD


@pytest.mark.parametrize(
    "said",
    [
        f"<think>perhaps {DRAFT}",
        f"<thinking>{DRAFT}",
        f"[THINK]{DRAFT}",
        f"<|channel|>analysis<|message|>{DRAFT}",
        f"analysisThe user wants {DRAFT}",
        f"<think>perhaps {DRAFT}</think>",
    ],
)
def test_a_draft_in_thoughts_without_an_answer_is_no_answer(said):
    assert split_thoughts(said)[1] == ""
    assert completion(said).text == ""


@pytest.mark.parametrize(
    "said",
    ['{"objects": ["the thinking cap"], "x": [1]}', '{"objects": ["channel", "a reason"]}', "[thing] {}", "a<b {}"],
)
def test_an_answer_that_only_mentions_thinking_stays(said):
    assert split_thoughts(said) == ("", said)


def completion(content, finish="stop", **more):
    choice = {"finish_reason": finish, "message": {"role": "assistant", "content": content, **more}}
    return read_completion(json.dumps({"choices": [choice]}).encode())


@pytest.mark.parametrize(
    "content",
    [
        [{"type": "text", "text": GOOD[:5]}, {"type": "text", "text": GOOD[5:]}],
        [{"type": "thinking", "thinking": [{"type": "text", "text": DRAFT}]}, {"type": "text", "text": GOOD}],
        [{"type": "reasoning", "text": DRAFT}, {"type": "output_text", "text": GOOD}],
        [GOOD],
        [{"text": GOOD}],
        [None, 3, {"type": "image_url", "image_url": {}}, {"type": "text", "text": GOOD}],
    ],
)
def test_parts_are_joined_and_parts_of_other_kinds_left_out(content):
    assert completion(content).text == GOOD


@pytest.mark.parametrize("key", ["reasoning_content", "reasoning", "thinking"])
def test_reasoning_beside_an_answer_is_ignored_and_an_answer_in_its_place_is_one(key):
    assert completion(GOOD, **{key: DRAFT}).text == GOOD
    for empty in (None, "", []):
        assert completion(empty, **{key: GOOD}).text == GOOD
        assert completion(empty, **{key: f"perhaps {DRAFT}, who knows"}).text == ""
        assert completion(empty, "length", **{key: DRAFT}).text == ""


def test_why_the_answer_ends_and_whether_it_was_declined():
    assert completion(None, "length").finish == "length"
    assert completion(GOOD, None).finish == ""
    assert completion(None, refusal="I cannot").refused
    assert completion([{"type": "refusal", "refusal": "no"}]).refused
    assert not completion(GOOD, refusal=None).refused


def test_a_stream_that_nobody_asked_for_is_joined():
    pieces = [
        {"choices": [{"delta": {"role": "assistant", "reasoning_content": DRAFT}}]},
        *({"choices": [{"delta": {"content": each}}]} for each in (GOOD[:4], GOOD[4:])),
        {"choices": [{"delta": {}, "finish_reason": "length"}]},
        {"choices": [], "usage": {}},
    ]
    text = ": hello\n\n" + "".join(f"data: {json.dumps(each)}\n\n" for each in pieces) + "data: [DONE]\n\n"
    assert read_completion(text.encode()).text == GOOD
    assert read_completion(text.replace("\n", "\r\n").encode()).finish == "length"


@pytest.mark.parametrize(
    "answer",
    [b"", b"[]", b"null", b'{"choices": [3]}', b"data: [DONE]\n", b"data: {broken", b"\xff",
     b'{"choices": [{"message": {"content": 3}}]}', b'{"choices": [{"message": "hello"}]}'],
)  # fmt: skip
def test_whatever_else_is_no_completion(answer):
    with pytest.raises(CompletionError, match="something other than a chat completion"):
        read_completion(answer)


@pytest.mark.parametrize(
    "answer", [b'{"error": "no"}', b'{"error": {"message": "overloaded"}}', b'{"detail": "Not Found"}']
)
def test_an_error_under_status_200_is_said_to_be_one(answer):
    with pytest.raises(CompletionError, match="an error, under status 200, in place"):
        read_completion(answer)


def test_compressed_bytes_are_named():
    with pytest.raises(CompletionError, match="compressed"):
        read_completion(gzip.compress(b"{}"))


def test_a_web_page_is_said_to_be_one():
    with pytest.raises(CompletionError, match="a web page"):
        read_completion(b"\n<!doctype html><title>Sign in</title>")


def test_tags_without_end_cost_no_time():
    assert split_thoughts("<" + "think" * 100_000)[0] == ""
