"""Ask a language model behind an OpenAI-compatible address for JSON, and accept only legal answers.

What the server may cost is bounded: two answers, a time and a size for each, and three waits. The key comes from the
environment alone. Messages repeat only plain words of the server that share nothing with a secret.
"""

from __future__ import annotations

import base64
import difflib
import json
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar
from urllib.parse import parse_qsl, unquote, urlsplit, urlunsplit

from grounding.parsers.llm_completion import Completion, CompletionError, read_completion
from grounding.parsers.llm_dialect import BUSY, LONGEST_WAIT, Dialect, about_the_model, error_field, seconds_to_wait
from grounding.parsers.llm_exchange import Answer, Exchange, ExchangeError
from grounding.parsers.llm_json import MAX_CONTENT, brief, read_answers, shares_secret
from grounding.parsers.llm_reply import ANSWERS, NONE, IllegalReplyError, LLMError, Reply, certain

_Read = TypeVar("_Read")
KEY_VARIABLE = "STRUCTAGENT_LLM_KEY"
# The other tools' key is sent where it belongs, and not to whatever address is tried out here.
OPENAI_KEY_VARIABLE, OPENAI = "OPENAI_API_KEY", "https://api.openai.com"
MAX_ANSWER_BYTES = 512 * 1024  # thoughts of the larger budget, several times over, as some servers repeat them
MAX_ANSWER_TOKENS = 200
# What a model may think before its answer, in tokens; and how much more it gets where that was not enough.
REASONING_TOKENS, MORE = 2000, 4
TRIES = 2
WAITS = 3
MAX_MODELS = 8  # that a message lists
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
        report: takes a sentence when a busy server is waited for.
        wait: waits for a number of seconds.

    Raises:
        LLMError: for an invalid address or key. The server is first contacted with the first instruction.
    """

    gives_probabilities = False

    def __init__(
        self,
        url: str,
        model: str,
        connect_seconds: float = 5.0,
        answer_seconds: float = 60.0,
        send_key: bool = True,
        report: Callable[[str], None] = lambda _: None,
        wait: Callable[[float], None] = time.sleep,
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
        self.dialect = Dialect()
        self._report, self._wait = report, wait

    def ask(self, prompt: str, text: str) -> Reply:
        """Ask the model about one instruction; an answer that is not legal is asked for once more."""
        messages = [
            {"role": "system", "content": f"{prompt.strip()}\n\n{_AS_JSON}"},
            {"role": "user", "content": f'Instruction: "{text}"'},
        ]
        return self.ask_json(
            messages, ("structure", SCHEMA), MAX_ANSWER_TOKENS,
            lambda content: certain(read_answers(content, self.secrets)),
        )  # fmt: skip

    def ask_json(
        self,
        messages: Sequence[Mapping[str, str]],
        schema: tuple[str, dict[str, Any]],
        most_tokens: int,
        read: Callable[[str], _Read],
        again: Callable[[str], str] | None = None,
    ) -> _Read:
        """Ask for JSON; an answer that is not legal is asked for once more.

        Args:
            messages: what the model is told, and the question.
            schema: a name, and the JSON schema for servers that take one.
            most_tokens: of an answer, without what the model thinks before it.
            read: reads the model's text, and raises a `ValueError` that says what is not legal in it.
            again: makes the question that follows an answer that is not legal, from what `read` said of it; `None`
                asks the first one once more.

        Raises:
            LLMError: for a server that cannot be used; an `IllegalReplyError` for answers that are not legal.
        """
        form = {"type": "json_schema", "json_schema": {"name": schema[0], "strict": True, "schema": schema[1]}}
        budget, problem = most_tokens + REASONING_TOKENS, ""
        for _ in range(TRIES):
            said = self._completion({"model": self.model, "messages": list(messages)}, budget, form)
            try:
                return read(said.text)
            except ValueError as error:
                problem = str(error)
            if said.refused or said.finish not in ("", "stop", "length"):
                end = "" if said.refused else f" (finish_reason {brief(said.finish, self.secrets)})"
                raise IllegalReplyError(str(self._error(f"declined to answer{end}: {problem}")))
            if said.finish == "length":
                problem = f'{budget} tokens were not enough for it to think and to answer (finish_reason "length")'
                budget *= MORE
            elif again is not None and said.text:
                answer = {"role": "assistant", "content": said.text[:MAX_CONTENT]}
                messages = [*messages, answer, {"role": "user", "content": again(problem)}]
        raise IllegalReplyError(str(self._error(f"gave no legal answer in {TRIES} tries: {problem}")))

    def _completion(self, body: dict[str, Any], budget: int, form: dict[str, Any]) -> Completion:
        """Return what the model says, with the parameters that its server takes."""
        dialect: Dialect | None = self.dialect
        while dialect is not None:
            answer = self._post(body | dialect.body(budget, form))
            if answer.status == 200:
                try:
                    said = read_completion(answer.body)
                except CompletionError as error:
                    # A server that is broken in itself will be no better at a second try; a model may be.
                    raise self._error(str(error)) from error
                self.dialect = dialect
                return said
            dialect = dialect.after(answer.status, answer.text)
        raise self._error(_meaning(answer.status, self._withheld) + self._which_models(answer))

    def _post(self, body: dict[str, Any]) -> Answer:
        """Return the server's answer; wait for a server that is busy."""
        for tries in range(WAITS + 1):
            try:
                answer = self._exchange.post(body)
            except ExchangeError as error:
                raise self._error(str(error)) from error
            if answer.status not in BUSY or "quota" in error_field(answer.text, "code"):
                return answer
            seconds = seconds_to_wait(answer.headers, tries)
            if seconds > LONGEST_WAIT:
                raise self._error(
                    f"is busy (status {answer.status}) and asks to wait for {seconds:.0f} s, which is longer than "
                    f"{LONGEST_WAIT:.0f} s"
                )
            if tries < WAITS:
                self._report(str(self._error(f"is busy (status {answer.status}); waiting for {seconds:.0f} s")))
                self._wait(seconds)
        raise self._error(f"is still busy (status {answer.status}) after {WAITS} waits")

    def _which_models(self, answer: Answer) -> str:
        """Name the server's models where a refusal may be about the model; nothing where the server has this one."""
        said_so = about_the_model(answer.status, answer.text)
        if answer.status not in (400, 404, 422) and not said_so:
            return ""
        otherwise = "; --llm-model names the model, and the server says that it has none of this name"
        try:
            listed = json.loads(self._exchange.get(_models_address(self._url)).body)
            names = [each["id"] for each in listed["data"]]
        except (ExchangeError, ValueError, LookupError, TypeError, RecursionError):
            return otherwise if said_so else ""
        names = [name for name in names if self._may_be_shown(name)]
        if self.model in names or not names:
            return otherwise if said_so and not names else ""
        near = difflib.get_close_matches(self.model, names, MAX_MODELS)
        shown = [*near, *(name for name in names if name not in near)][:MAX_MODELS]
        more = f" and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
        return f"; it lists no model of this name; name one of its models with --llm-model: {', '.join(shown)}{more}"

    def _may_be_shown(self, name: object) -> bool:
        return (
            isinstance(name, str)
            and re.fullmatch(r"[\w./:@+-]{1,80}", name, re.ASCII) is not None
            and not any(shares_secret(name, secret) for secret in self.secrets)
        )

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


def _secrets(url: str, key: str) -> frozenset[str]:
    """Return the key, and the user, password and query of an address, also in their encoded forms."""
    parts = urlsplit(url)
    user, password = unquote(parts.username or ""), unquote(parts.password or "")
    plain = {key, user, password, *(value for _, value in parse_qsl(parts.query))}
    sent = {base64.b64encode(each.encode()).decode() for each in (key, f"{user}:{password}") if each.strip(":")}
    return frozenset(filter(None, plain | sent))


def _meaning(status: int, withheld: str | None) -> str:
    if 300 <= status < 400:
        return f"redirected the request (status {status}), and redirects are not followed"
    if status in (401, 403) and withheld:
        return (
            f"requires a key (status {status}), and the one in {withheld} is sent only to the host that you name "
            "yourself, by --llm-url, STRUCTAGENT_LLM_URL or llm_url in your own file"
        )
    if status in (401, 403):
        return f"requires a valid key (status {status}); set {KEY_VARIABLE}"
    if status == 429:
        return "has no quota left for this key (status 429)"
    return f"answered with status {status}"


def _models_address(url: str) -> str:
    parts = urlsplit(url)
    return urlunsplit(parts._replace(path=parts.path.removesuffix("/chat/completions") + "/models"))


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
        raise LLMError("the language model's address is not an http or https address")
    path = parts.path.rstrip("/")
    if not path.endswith("/chat/completions"):
        path += "/chat/completions"
    shown_host = f"[{host}]" if ":" in host else host
    shown = f"{shown_host}:{port}" if port else shown_host
    return (
        urlunsplit((parts.scheme, parts.netloc, path, parts.query, "")),
        urlunsplit((parts.scheme, shown, path, "", "")),
    )
