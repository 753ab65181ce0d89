"""A language model behind an OpenAI-compatible address: asked for JSON, believed only where it is legal.

What the server may cost is bounded: two answers, a time and a size for each. The key comes from the
environment alone and is in no message.
"""

from __future__ import annotations

import json
import os
import re
import time
from functools import cached_property
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit, urlunsplit

from grounding.llm_reply import ANSWERS, NONE, IllegalReplyError, LLMError, Reply, certain

if TYPE_CHECKING:
    import httpx

KEY_VARIABLES = ("STRUCTAGENT_LLM_KEY", "OPENAI_API_KEY")
MAX_ANSWER_BYTES = 64 * 1024
MAX_ANSWER_TOKENS = 200
MAX_CONTENT = 4000  # characters of what the model says
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
        answer_seconds: how long one answer may take, from the request to its last byte.

    Raises:
        LLMError: for an address that is none. The server is first asked with the first instruction.
    """

    gives_probabilities = False

    def __init__(
        self, url: str, model: str, connect_seconds: float = 5.0, answer_seconds: float = 30.0
    ) -> None:
        self._url, self.shown_url = _addresses(url)
        self.model = model
        self.identity = f"{model} at {self.shown_url}"
        self._connect_seconds = connect_seconds
        self._answer_seconds = answer_seconds
        self._key = next(filter(None, (os.environ.get(name, "").strip() for name in KEY_VARIABLES)), "")
        if not (self._key.isascii() and self._key.isprintable()):
            raise LLMError(f"the key in {' or '.join(KEY_VARIABLES)} has characters that no key can have")
        self._knows_schema = True

    def ask(self, prompt: str, text: str) -> Reply:
        """The model's answers to one instruction; an answer that is not legal is asked for once more."""
        problem = ""
        for _ in range(TRIES):
            content = self._answer(prompt, text)
            try:
                return certain(read_answers(content))
            except ValueError as error:
                problem = str(error)
        raise IllegalReplyError(str(self._error(f"gave no legal answer in {TRIES} tries: {problem}")))

    def _answer(self, prompt: str, text: str) -> str:
        """What the model says, after one step back where the server does not know a JSON schema."""
        body: dict[str, Any] = {
            "model": self.model,
            "messages": [
                {"role": "system", "content": f"{prompt.strip()}\n\n{_AS_JSON}"},
                {"role": "user", "content": f'Instruction: "{text}"'},
            ],
            "temperature": 0,
            "max_tokens": MAX_ANSWER_TOKENS,
        }
        schema = {"name": "structure", "strict": True, "schema": SCHEMA}
        if self._knows_schema:
            status, answer = self._post(
                body | {"response_format": {"type": "json_schema", "json_schema": schema}}
            )
            if status == 200:
                return self._content(answer)
        if not self._knows_schema or status in _SCHEMA_REFUSED:
            status, answer = self._post(body)
            if status == 200:
                self._knows_schema = False
                return self._content(answer)
        raise self._error(_meaning(status))

    def _post(self, body: dict[str, Any]) -> tuple[int, bytes]:
        """The status and the bytes of the answer, which is given up where it is too long or too slow."""
        import httpx

        deadline = time.monotonic() + self._answer_seconds
        received = b""
        try:
            with self._client.stream("POST", self._url, json=body) as response:
                if response.status_code != 200:
                    return response.status_code, b""
                for piece in response.iter_raw():  # not unpacked: small bytes could become large ones
                    received += piece
                    if len(received) > MAX_ANSWER_BYTES:
                        raise self._error(f"answered with more than {MAX_ANSWER_BYTES // 1024} KiB")
                    if time.monotonic() > deadline:
                        raise self._error(f"took longer than {self._answer_seconds:g} s to answer")
                return 200, received
        except httpx.ConnectTimeout as error:
            raise self._error(f"could not be reached within {self._connect_seconds:g} s") from error
        except httpx.TimeoutException as error:
            raise self._error(f"took longer than {self._answer_seconds:g} s to answer") from error
        except httpx.ConnectError as error:
            raise self._error("could not be reached") from error
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as error:
            raise self._error(f"could not be talked to ({type(error).__name__})") from error

    @cached_property
    def _client(self) -> httpx.Client:
        import httpx

        headers = {"Accept-Encoding": "identity"}
        if self._key:
            headers["Authorization"] = f"Bearer {self._key}"
        timeout = httpx.Timeout(self._answer_seconds, connect=self._connect_seconds)
        return httpx.Client(timeout=timeout, headers=headers, follow_redirects=False)

    def _content(self, answer: bytes) -> str:
        """What the model said, out of the server's answer."""
        try:
            content = json.loads(answer)["choices"][0]["message"]["content"]
        except (ValueError, LookupError, TypeError, RecursionError):
            content = None
        # A server that is broken in itself will be no better at a second try; a model may be.
        if not isinstance(content, str):
            raise self._error("answered with something else than a chat completion")
        # Whoever knows the key could have it said: nothing of an answer is shown with it.
        return content.replace(self._key, "***") if self._key else content

    def _error(self, what: str) -> LLMError:
        return LLMError(f"the language model {self.model!r} at {self.shown_url} {what}")


def read_answers(content: str) -> dict[str, str]:
    """Question -> legal answer, from what a model said: one JSON object, whatever is around it.

    Raises:
        ValueError: for none or several objects, or anything in it that is not legal.
    """
    if len(content) > MAX_CONTENT:
        raise ValueError(f"it is {len(content)} characters long")
    found = []
    decoder = json.JSONDecoder()
    at = content.find("{")
    while at >= 0:
        try:
            value, end = decoder.raw_decode(content, at)
            found.append(value)
        except (ValueError, RecursionError):
            end = at + 1
        at = content.find("{", end)
    if len(found) != 1:
        raise ValueError(f"it holds {'several JSON objects' if found else 'no JSON object'}")
    (said,) = found
    if set(said) != set(ANSWERS):
        wrong = sorted(set(said) ^ set(ANSWERS))[0]
        raise ValueError(f"{_brief(wrong)} is {'missing' if wrong in ANSWERS else 'no question'}")
    for question, answer in said.items():
        if answer is None and NONE in ANSWERS[question]:
            said[question] = NONE
        elif not isinstance(answer, str) or answer not in ANSWERS[question] or answer == NONE:
            raise ValueError(f"{question} cannot be {_brief(answer)}")
    return said


def _brief(value: object) -> str:
    """A value of the model's, short and on one line."""
    text = re.sub(r"\s+", " ", json.dumps(value))
    return text if len(text) <= 40 else f"{text[:37]}..."


def _meaning(status: int) -> str:
    if 300 <= status < 400:
        return f"sent the request elsewhere (status {status}), which is not followed"
    if status in (401, 403):
        return f"wants a valid key (status {status}); set {KEY_VARIABLES[0]}"
    return f"answered with status {status}"


def _addresses(url: str) -> tuple[str, str]:
    """Where to ask, and the same address as it may be shown: without user, password and query."""
    try:
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
