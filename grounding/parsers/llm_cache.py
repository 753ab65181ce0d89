"""Cache replies of a language model in a file, so that a table can be computed again without the model."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path

from grounding.parsers.llm_reply import ANSWERS, LLMError, Reply


class ReplyCache:
    """Replies about the five slots by model, prompt and text in a file of JSON lines, which only grows.

    A last line that was torn off by a crash, or a line that has no legal reply, counts as not there.

    Args:
        path: of the file; it is made with the first reply.

    Raises:
        LLMError: for a file that cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._replies: dict[str, Reply] = {}
        try:
            lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines()
        except FileNotFoundError:
            lines = []
        except OSError as error:
            raise LLMError(f"the reply cache {self.path} cannot be read: {error.strerror}") from error
        for line in lines:
            try:
                entry = json.loads(line)
                key, reply = entry["key"], entry["reply"]
            except (ValueError, KeyError, TypeError):
                continue
            if _is_reply(reply):
                self._replies[str(key)] = reply

    def __len__(self) -> int:
        return len(self._replies)

    def get(self, identity: str, prompt_sha256: str, text: str) -> Reply | None:
        """Find the reply that was given before, or `None`."""
        return self._replies.get(_key(identity, prompt_sha256, text))

    def put(self, identity: str, prompt_sha256: str, text: str, reply: Reply) -> None:
        """Store a reply, in the file at once.

        Raises:
            LLMError: if the file cannot be written.
        """
        key = _key(identity, prompt_sha256, text)
        entry = {"key": key, "model": identity, "prompt_sha256": prompt_sha256, "text": text, "reply": reply}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # A line of its own even after a torn one.
            with self.path.open("ab+") as file:
                torn = file.tell() > 0 and _last_byte(file) != b"\n"
                file.write(b"\n" * torn + json.dumps(entry, allow_nan=False).encode() + b"\n")
        except OSError as error:
            raise LLMError(f"the reply cache {self.path} cannot be written: {error.strerror}") from error
        self._replies[key] = reply


def _last_byte(file) -> bytes:
    file.seek(-1, 2)
    return file.read(1)


def _key(identity: str, prompt_sha256: str, text: str) -> str:
    return hashlib.sha256(json.dumps([identity, prompt_sha256, text]).encode()).hexdigest()


def _is_reply(reply: object) -> bool:
    """Return whether every question has a probability for every legal answer and nothing else."""
    return (
        isinstance(reply, dict)
        and set(reply) == set(ANSWERS)
        and all(
            isinstance(reply[question], dict)
            and set(reply[question]) == set(legal)
            and all(isinstance(p, (int, float)) and 0 <= p <= 1 for p in reply[question].values())
            and math.isclose(sum(reply[question].values()), 1.0, abs_tol=1e-3)
            for question, legal in ANSWERS.items()
        )
    )
