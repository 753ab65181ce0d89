"""Cache replies of a language model in a file, so that a table can be computed again without the model."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from grounding.parsers.llm_reply import ANSWERS, LLMError, Reply

T = TypeVar("T")


class AnswerCache(Generic[T]):
    """Answers by model, prompt and text in a file of JSON lines, which only grows.

    A last line that was torn off by a crash, or a line that has no legal answer of this kind, counts as not there: one
    file can hold answers of several kinds.

    Args:
        path: of the file; it is made with the first answer.
        kind: the key under which a line holds its answer.
        is_legal: whether a JSON value is an answer.

    Raises:
        LLMError: for a file that cannot be read.
    """

    def __init__(self, path: str | Path, kind: str, is_legal: Callable[[object], bool]) -> None:
        self.path, self.kind = Path(path), kind
        self._replies: dict[str, T] = {}
        try:
            lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines()
        except FileNotFoundError:
            lines = []
        except OSError as error:
            raise LLMError(f"the reply cache {self.path} cannot be read: {error.strerror}") from error
        for line in lines:
            try:
                entry = json.loads(line)
                key, reply = entry["key"], entry[kind]
            except (ValueError, KeyError, TypeError):
                continue
            if is_legal(reply):
                self._replies[str(key)] = reply

    def __len__(self) -> int:
        return len(self._replies)

    def get(self, identity: str, prompt_sha256: str, text: str) -> T | None:
        """Find the answer that was given before, or `None`."""
        return self._replies.get(_key(identity, prompt_sha256, text))

    def put(self, identity: str, prompt_sha256: str, text: str, reply: T) -> None:
        """Store an answer, in the file at once.

        Raises:
            LLMError: if the file cannot be written.
        """
        key = _key(identity, prompt_sha256, text)
        entry = {"key": key, "model": identity, "prompt_sha256": prompt_sha256, "text": text, self.kind: reply}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # A line of its own even after a torn one.
            with self.path.open("ab+") as file:
                torn = file.tell() > 0 and _last_byte(file) != b"\n"
                file.write(b"\n" * torn + json.dumps(entry, allow_nan=False).encode() + b"\n")
        except OSError as error:
            raise LLMError(f"the reply cache {self.path} cannot be written: {error.strerror}") from error
        self._replies[key] = reply


class ReplyCache(AnswerCache[Reply]):
    """Replies of a language model about the five slots.

    Args:
        path: as for `AnswerCache`.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "reply", _is_reply)


def _last_byte(file) -> bytes:  # noqa: ANN001 - a binary file
    file.seek(-1, 2)
    return file.read(1)


def _key(identity: str, prompt_sha256: str, text: str) -> str:
    return hashlib.sha256(json.dumps([identity, prompt_sha256, text]).encode()).hexdigest()


def _is_reply(reply: object) -> bool:
    """Return whether every question has a probability for every legal answer and nothing else."""
    return isinstance(reply, dict) and set(reply) == set(ANSWERS) and all(
        isinstance(reply[question], dict)
        and set(reply[question]) == set(legal)
        and all(isinstance(p, (int, float)) and 0 <= p <= 1 for p in reply[question].values())
        and math.isclose(sum(reply[question].values()), 1.0, abs_tol=1e-3)
        for question, legal in ANSWERS.items()
    )
