"""The client speaks as its server does: parameters, waits, models and budgets."""

import json

import pytest

from grounding.parsers.llm import LLMParser
from grounding.parsers.llm_dialect import Dialect, seconds_to_wait
from grounding.parsers.llm_endpoint import EndpointLLM
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from tests.grounding.parsers.test_llm_endpoint import CIRCLE, KEY, key, says, serving  # noqa: F401 - a fixture

GOOD = json.dumps(CIRCLE)


def refuses(message, status=400, headers=None, **more):
    return status, headers or {}, json.dumps({"error": {"message": message, **more}}).encode()


def finishing(content, finish, **more):
    choice = {"finish_reason": finish, "message": {"content": content, **more}}
    return 200, {}, json.dumps({"choices": [choice]}).encode()


def ask(answer, times=1, models=(), model="some-model"):
    """The size that was read, the requests, what was told, and the seconds waited."""
    told, waited, parsed = [], [], None
    with serving(answer, models) as server:
        llm = LLMParser(EndpointLLM(server.url, model, report=told.append, wait=waited.append))
        try:
            for _ in range(times):
                parsed = llm.parse("a small circle on the left")
        except LLMError as error:
            parsed = error
    return parsed, [body for _, body in server.requests], told, waited


def takes(*, refused, say):
    """A server that refuses parameters, one at a time, in the words of `say`."""

    def answer(_, body):
        for name in refused:
            if name in body:
                return say(name)
        return says(GOOD)

    return answer


WAYS = {
    "param": lambda name: refuses("Unsupported parameter", param=name),
    "sentence": lambda name: refuses(f"'{name}' is not supported here. Use 'max_completion_tokens' instead."),
    "string": lambda name: (400, {}, json.dumps({"error": f"{name}: unknown field"}).encode()),
    "detail": lambda name: (422, {}, json.dumps({"detail": [{"loc": ["body", name], "msg": "extra"}]}).encode()),
    "no_words": lambda name: (400, {}, b"Bad Request"),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    "refused", [("max_tokens",), ("temperature",), ("max_tokens", "temperature", "response_format")]
)
def test_what_a_server_refuses_is_not_sent_again(refused, way):
    parsed, requests, *_ = ask(takes(refused=refused, say=WAYS[way]), times=2)
    assert parsed.spec.size == "small"
    assert not set(refused) & set(requests[-1]) and len(requests) <= 2 + 2 + len(refused)
    assert set(requests[-1]) == set(requests[-2])  # the second instruction is asked about as the first one was at last
    if way != "no_words":
        assert ("max_completion_tokens" in requests[-1]) is ("max_tokens" in refused)
        assert ("response_format" in requests[-1]) is ("response_format" not in refused)


def test_both_names_of_the_budget_can_be_refused():
    parsed, requests, *_ = ask(takes(refused=("max_tokens", "max_completion_tokens"), say=WAYS["sentence"]))
    assert parsed.spec.size == "small" and "max_completion_tokens" not in requests[-1]


def test_a_server_whose_grammar_fails_is_asked_without_a_schema():
    def answer(_, body):
        return refuses("Failed to initialize samplers", 500) if "response_format" in body else says(GOOD)

    parsed, requests, *_ = ask(answer)
    assert parsed.spec.size == "small" and len(requests) == 2


def test_a_refusal_of_everything_ends():
    keys, dialect, steps = None, Dialect(), 0
    while dialect is not None:
        keys, dialect, steps = dialect.keys, dialect.after(400, "temperature max_tokens response_format"), steps + 1
    assert keys == () and steps <= 6
    parsed, requests, *_ = ask(lambda *_: (400, {}, b"no"))
    assert "answered with status 400" in str(parsed) and len(requests) == 4  # the last one asks for the models


def test_thoughts_have_room_and_get_more_once():
    def answer(_, body):
        return finishing(None, "length", reasoning_content="well " * 50) if body["max_tokens"] < 5000 else says(GOOD)

    parsed, requests, *_ = ask(answer)
    assert parsed.spec.size == "small"
    assert requests[0]["max_tokens"] >= 1000 and len(requests) == 2


@pytest.mark.parametrize("content", [None, "", GOOD[:30], "<think>well, " + GOOD])
def test_a_budget_that_is_spent_twice_is_named(content):
    parsed, requests, *_ = ask(lambda *_: finishing(content, "length"))
    assert isinstance(parsed, IllegalReplyError) and len(requests) == 2
    assert f"{requests[1]['max_tokens']} tokens were not enough" in str(parsed) and "length" in str(parsed)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (finishing(None, "content_filter"), 'declined to answer .finish_reason "content_filter"'),
        (finishing("", "safety"), 'declined to answer .finish_reason "safety"'),
        (finishing(None, "stop", refusal=f"no, {KEY}"), "declined to answer: it holds no JSON"),
        (finishing(None, KEY), "declined to answer .finish_reason a text of"),
    ],
)
def test_a_model_that_declines_is_asked_once(said, why):
    parsed, requests, *_ = ask(lambda *_: said)
    assert isinstance(parsed, IllegalReplyError) and len(requests) == 1
    with pytest.raises(LLMError, match=why):
        raise parsed
    assert KEY not in str(parsed)


def test_an_empty_answer_is_asked_for_once_more():
    parsed, requests, *_ = ask(lambda n, _: finishing(None if n == 1 else GOOD, "stop"))
    assert parsed.spec.size == "small" and len(requests) == 2


@pytest.mark.parametrize("status", [429, 503, 529])
def test_a_busy_server_is_waited_for_and_that_is_told(status):
    def answer(n, _):
        return refuses("slow down", status, {"Retry-After": "7"} if n == 1 else {}) if n < 3 else says(GOOD)

    parsed, requests, told, waited = ask(answer)
    assert parsed.spec.size == "small" and len(requests) == 3
    assert waited == [7.0, 2.0]
    assert f"is busy (status {status}); waiting for 7 s" in told[0] and len(told) == 2
    assert all("response_format" in body for body in requests)  # being busy is no refusal of a parameter


def test_waits_end():
    parsed, requests, told, waited = ask(lambda *_: refuses("slow down", 429))
    assert "still busy (status 429) after 3 waits" in str(parsed)
    assert waited == [1.0, 2.0, 4.0] and len(requests) == 4
    parsed, requests, told, waited = ask(lambda *_: refuses("slow down", 503, {"Retry-After": "86400"}))
    assert "asks to wait for 86400 s, which is longer than 60 s" in str(parsed)
    assert waited == [] and len(requests) == 1


def test_a_quota_that_is_spent_is_not_waited_for():
    parsed, requests, _, waited = ask(lambda *_: refuses("You exceeded", 429, code="insufficient_quota"))
    assert "no quota left" in str(parsed) and waited == [] and len(requests) == 1


def test_a_wait_can_be_interrupted():
    def interrupt(_):
        raise KeyboardInterrupt

    with serving(lambda *_: refuses("slow down", 429)) as server, pytest.raises(KeyboardInterrupt):
        LLMParser(EndpointLLM(server.url, "some-model", wait=interrupt)).parse("a small circle")


@pytest.mark.parametrize(
    ("said", "seconds"),
    [
        ("20", 20.0),
        ("0", 0.0),
        ("1.5", 1.5),
        ("Thu, 01 Jan 2026 10:00:30 GMT", 30.0),
        ("Thu, 01 Jan 2026 10:00:30 -0000", 30.0),
        ("Thu, 01 Jan 2026 09:00:00 GMT", 0.0),
        ("", 4.0),
        ("-5", 4.0),
        ("nan", 4.0),
        ("soon", 4.0),
        ("1e9", 4.0),
        ("Fri, 31 Dec 99999999999 23:59:59 GMT", 4.0),
    ],
)
def test_how_long_a_server_wants_to_be_left_alone(said, seconds):
    headers = {"retry-after": said, "date": "Thu, 01 Jan 2026 10:00:00 GMT"}
    assert seconds_to_wait(headers, 2) == seconds


@pytest.mark.parametrize(
    "refusal",
    [
        refuses('model "default" not found, try pulling it first', 404),
        refuses("The model `default` does not exist or you do not have access to it.", 404, code="model_not_found"),
        refuses("no", 400, param="model"),
        refuses("unknown model", 400),
    ],
)
def test_a_missing_model_is_named_with_those_that_are_there(refusal):
    models = ["qwen3:4b", "meta-llama/Llama-3.3-70B", f"{KEY}", "<b>evil", "x" * 200, *(f"m{n}" for n in range(20))]
    parsed, requests, *_ = ask(lambda *_: refusal, models=models, model="qwen3-4b")
    assert len(requests) == 2 and requests[1] == "/v1/models"
    said = str(parsed)
    assert "name one of its models with --llm-model: qwen3:4b, meta-llama/Llama-3.3-70B, m0" in said
    assert "and 14 more" in said and "evil" not in said and KEY not in said and "\n" not in said


def test_a_missing_model_is_named_where_the_server_lists_none():
    parsed, *_ = ask(lambda *_: refuses('model "some-model" not found', 404))
    assert "answered with status 404; --llm-model names the model" in str(parsed)


def test_a_model_that_is_listed_is_not_the_problem():
    parsed, *_ = ask(lambda *_: refuses("the context is full", 400), models=["some-model", "other"])
    assert "answered with status 400" in str(parsed) and "--llm-model" not in str(parsed)
