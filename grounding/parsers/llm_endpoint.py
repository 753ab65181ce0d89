"""Ask a language model behind an OpenAI-compatible address for JSON, and accept only legal answers.

What the server may cost is bounded: two answers, a time and a size for each. The key comes from the
environment alone. Messages repeat only plain words of the server that share nothing with a secret.
"""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Callable, Collection
from typing import Any, TypeVar
from urllib.parse import parse_qsl, unquote, urlsplit, urlunsplit

from grounding.parsers.llm_exchange import Exchange, ExchangeError
from grounding.parsers.llm_reply import ANSWERS, NONE, IllegalReplyError, LLMError, Reply, certain

_Read = TypeVar("_Read")
KEY_VARIABLE = "STRUCTAGENT_LLM_KEY"
# The other tools' key is sent where it belongs, and not to whatever address is tried out here.
OPENAI_KEY_VARIABLE, OPENAI = "OPENAI_API_KEY", "https://api.openai.com"
MAX_ANSWER_BYTES = 64 * 1024
MAX_ANSWER_TOKENS = 200
MAX_CONTENT = 12_000  # characters of what the model says
TRIES = 2
# Servers that do not know a JSON schema answer with one of these.
_SCHEMA_REFUSED = (400, 404, 415, 422, 501)
_AS_JSON = (
    "Answer with one JSON object and nothing else, null for NONE, in this form:\n"
    '{"request": "build", "shape": "circle", "size": null, "x_position": "left", "y_position": null, '
    '"rotation": null}'
)
SCHEMA = {
    "type": "object",
    "properties": {
        question: {"enum": [None if answer == NONE else answer for answer in answers]}
        for question, answers in ANSWERS.items()
    },
    "required": list(ANSWERS),
    "additionalProperties": False,
}


class EndpointLLM:
    """A chat model at an OpenAI-compatible address.

    Args:
        url: such as "http://127.0.0.1:8080/v1"; "/chat/completions" is added where it is not there.
        model: its name there.
        connect_seconds: how long a connection may take.
        answer_seconds: how long one answer may take, from the connection to its last byte.
        send_key: whether the server may have the key; not where the address is somebody else's choice.

    Raises:
        LLMError: for an invalid address or key. The server is first contacted with the first instruction.
    """

    gives_probabilities = False

    def __init__(
        self,
        url: str,
        model: str,
        connect_seconds: float = 5.0,
        answer_seconds: float = 30.0,
        send_key: bool = True,
    ) -> None:
        self._url, self.shown_url = _addresses(url)
        self.model = model
        self.identity = f"{model} at {self.shown_url}"
        variable = key_variable(self._url)
        self._withheld = variable if not send_key else None
        key = os.environ[variable].strip() if variable and send_key else ""
        if not (key.isascii() and key.isprintable()):
            raise LLMError(f"the key in {variable} has characters that no key can have")
        headers = {"Accept-Encoding": "identity"} | ({"Authorization": f"Bearer {key}"} if key else {})
        self._exchange = Exchange(self._url, headers, connect_seconds, answer_seconds, MAX_ANSWER_BYTES)
        self.secrets = _secrets(self._url, key)
        self._knows_schema = True

    def ask(self, prompt: str, text: str) -> Reply:
        """Ask the model about one instruction; an answer that is not legal is asked for once more."""
        return self.ask_json(
            f"{prompt.strip()}\n\n{_AS_JSON}", text, ("structure", SCHEMA), MAX_ANSWER_TOKENS,
            lambda content: certain(read_answers(content, self.secrets)),
        )  # fmt: skip

    def ask_json(
        self, task: str, text: str, schema: tuple[str, dict[str, Any]], most_tokens: int, read: Callable[[str], _Read]
    ) -> _Read:
        """Ask for JSON about one instruction; an answer that is not legal is asked for once more.

        Args:
            task: what the model is told first.
            text: the instruction, as `quotable` gives it.
            schema: a name, and the JSON schema for servers that take one.
            most_tokens: of an answer.
            read: reads the model's text, and raises a `ValueError` that says what is not legal in it.

        Raises:
            LLMError: for a server that cannot be used; an `IllegalReplyError` for answers that are not legal.
        """
        body = {
            "model": self.model,
            "messages": [{"role": "system", "content": task}, {"role": "user", "content": f'Instruction: "{text}"'}],
            "temperature": 0,
            "max_tokens": most_tokens,
        }
        problem = ""
        for _ in range(TRIES):
            content = self._answer(body, schema)
            try:
                return read(content)
            except ValueError as error:
                problem = str(error)
        raise IllegalReplyError(str(self._error(f"gave no legal answer in {TRIES} tries: {problem}")))

    def _answer(self, body: dict[str, Any], schema: tuple[str, dict[str, Any]]) -> str:
        """Return the model's answer; retry without a JSON schema if the server does not support one."""
        if self._knows_schema:
            described = {"name": schema[0], "strict": True, "schema": schema[1]}
            status, answer = self._post(
                body | {"response_format": {"type": "json_schema", "json_schema": described}}
            )
            if status == 200:
                return self._content(answer)
        if not self._knows_schema or status in _SCHEMA_REFUSED:
            status, answer = self._post(body)
            if status == 200:
                self._knows_schema = False
                return self._content(answer)
        raise self._error(_meaning(status, self._withheld))

    def _post(self, body: dict[str, Any]) -> tuple[int, bytes]:
        try:
            return self._exchange.post(body)
        except ExchangeError as error:
            raise self._error(str(error)) from error

    def _content(self, answer: bytes) -> str:
        """Return the model's text from the server's answer."""
        try:
            content = json.loads(answer, object_pairs_hook=_once)["choices"][0]["message"]["content"]
        except _GivenTwice as error:
            raise self._error("answered with a JSON object in which a key is given twice") from error
        except (ValueError, LookupError, TypeError, RecursionError):
            content = None
        # A server that is broken in itself will be no better at a second try; a model may be.
        if not isinstance(content, str):
            raise self._error("answered with something else than a chat completion")
        return content

    def _error(self, what: str) -> LLMError:
        return LLMError(f"the language model {self.model!r} at {self.shown_url} {what}")


def key_variable(url: str | None) -> str | None:
    """Name the environment variable whose key is for an address (`None`: any that is not OpenAI's), if it is set."""
    if os.environ.get(KEY_VARIABLE, "").strip():
        return KEY_VARIABLE
    at_openai = url is not None and same_host(url, OPENAI)
    return OPENAI_KEY_VARIABLE if at_openai and os.environ.get(OPENAI_KEY_VARIABLE, "").strip() else None


def same_host(url: str, other: str) -> bool:
    """Tell whether two addresses have the same scheme, host and port, as the client that asks them understands them."""
    import httpx

    try:
        first, second = httpx.URL(url.strip()), httpx.URL(other.strip())
    except (httpx.InvalidURL, ValueError, TypeError):
        return False
    usual = {"http": 80, "https": 443}
    return bool(first.host) and all(
        one == two
        for one, two in (
            (first.scheme, second.scheme),
            (first.raw_host.lower(), second.raw_host.lower()),
            (first.port or usual.get(first.scheme), second.port or usual.get(second.scheme)),
        )
    )


class _GivenTwice(ValueError):
    """A JSON object that contains a key twice: readers differ in which of the two values counts."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise _GivenTwice("it gives a key twice in one JSON object")
    return found


def json_object(content: str) -> dict[str, Any]:
    """Find the one JSON object in a model's reply, whatever is around it.

    Raises:
        ValueError: for none or several, a key that is given twice, or a reply that is too long.
    """
    if len(content) > MAX_CONTENT:
        raise ValueError(f"it is {len(content)} characters long")
    found = []
    decoder = json.JSONDecoder(object_pairs_hook=_once)
    at = content.find("{")
    while at >= 0:
        try:
            value, end = decoder.raw_decode(content, at)
            found.append(value)
        except _GivenTwice:
            raise
        except (ValueError, RecursionError):
            end = at + 1
        at = content.find("{", end)
    if len(found) != 1:
        raise ValueError(f"it holds {'several JSON objects' if found else 'no JSON object'}")
    return found[0]


def read_answers(content: str, secrets: Collection[str] = ()) -> dict[str, str]:
    """Read question -> legal answer from a model's reply: one JSON object, whatever is around it.

    Args:
        content: what it said.
        secrets: what no message may hold, in any spelling.

    Raises:
        ValueError: for none or several objects, or anything in it that is not legal.
    """
    said = json_object(content)
    if set(said) != set(ANSWERS):
        wrong = sorted(set(said) ^ set(ANSWERS))[0]
        raise ValueError(f"{_brief(wrong, secrets)} is {'missing' if wrong in ANSWERS else 'no question'}")
    for question, answer in said.items():
        if answer is None and NONE in ANSWERS[question]:
            said[question] = NONE
        elif not isinstance(answer, str) or answer not in ANSWERS[question] or answer == NONE:
            raise ValueError(f"{question} cannot be {_brief(answer, secrets)}")
    return said


def _brief(value: object, secrets: Collection[str]) -> str:
    """Format a value of the model for a message, verbatim only if it is a few plain words without a secret."""
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, str):
        words = " ".join(value.split())
        if re.fullmatch(r"[A-Za-z_ ]{1,30}", words) and not any(shares_secret(words, secret) for secret in secrets):
            return json.dumps(words)
        return f"a text of {len(value)} characters"
    return {list: "a list", dict: "an object"}.get(type(value), "a number")


def shares_secret(words: str, secret: str) -> bool:
    """Return whether the words have four letters in a row that the secret has too, forwards or backwards."""
    said, hidden = (re.sub(r"[^a-z]", "", text.lower()) for text in (words, secret))
    run = min(4, len(hidden))
    pieces = (said[at : at + run] for at in range(len(said) - run + 1))
    return run > 0 and any(piece in hidden or piece in hidden[::-1] for piece in pieces)


def _secrets(url: str, key: str) -> frozenset[str]:
    """Return the key, and the user, password and query of an address, also in their encoded forms."""
    parts = urlsplit(url)
    user, password = unquote(parts.username or ""), unquote(parts.password or "")
    plain = {key, user, password, *(value for _, value in parse_qsl(parts.query))}
    sent = {base64.b64encode(each.encode()).decode() for each in (key, f"{user}:{password}") if each.strip(":")}
    return frozenset(filter(None, plain | sent))


def _meaning(status: int, withheld: str | None) -> str:
    if 300 <= status < 400:
        return f"sent the request elsewhere (status {status}), which is not followed"
    if status in (401, 403) and withheld:
        return (
            f"wants a key (status {status}), and the one in {withheld} is sent only to the host that you name "
            "yourself, by --llm-url, STRUCTAGENT_LLM_URL or llm_url in your own file"
        )
    if status in (401, 403):
        return f"wants a valid key (status {status}); set {KEY_VARIABLE}"
    return f"answered with status {status}"


def _addresses(url: str) -> tuple[str, str]:
    """Return the address to ask, and the form that may be shown: without user, password and query."""
    try:
        if any(char.isspace() or not char.isprintable() for char in url.strip()):
            raise ValueError  # urlsplit leaves out line breaks in silence, and would ask another address
        parts = urlsplit(url.strip())
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port, parts = None, None, urlsplit("")
    if parts.scheme not in ("http", "https") or not host:
        raise LLMError("the language model's address is no http or https address")
    path = parts.path.rstrip("/")
    if not path.endswith("/chat/completions"):
        path += "/chat/completions"
    shown_host = f"[{host}]" if ":" in host else host
    shown = f"{shown_host}:{port}" if port else shown_host
    return (
        urlunsplit((parts.scheme, parts.netloc, path, parts.query, "")),
        urlunsplit((parts.scheme, shown, path, "", "")),
    )
