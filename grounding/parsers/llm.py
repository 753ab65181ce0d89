"""Parse instructions with a few-shot prompted language model: paper appendix A.1, for all five slots.

The model answers six questions: what kind of request it is, and one per slot. The back end
(`llm_local`, `llm_endpoint`) determines which model answers and how; it returns only legal answers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from grounding.parse_result import Parse, decide, unreadable
from grounding.parsers.llm_cache import ReplyCache
from grounding.parsers.llm_reply import BUILD, NONE, Backend, Reply, quotable
from grounding.spec import SLOTS
from prompts import load_prompt

PROMPT = "parse_structure"
# About 200 English words. A token is at least a byte, so no text costs more tokens than this.
MAX_BYTES = 1200


class LLMParser:
    """A parser that reads instructions by asking a language model.

    Args:
        backend: the language model.
        prompt: the few-shot prompt; `None` for the one in `prompts/`.
        cache: where replies are looked up first and kept.
    """

    name = "llm"

    def __init__(self, backend: Backend, prompt: str | None = None, cache: ReplyCache | None = None) -> None:
        self.backend = backend
        self.prompt = load_prompt(PROMPT) if prompt is None else prompt
        self.prompt_sha256 = hashlib.sha256(self.prompt.encode()).hexdigest()
        self._cache = cache

    def parse(self, text: str) -> Parse:
        """Parse one instruction.

        Raises:
            LLMError: if the language model cannot be used. No text alone can bring that about.
        """
        quoted = quotable(text)
        if not any(char.isalnum() for char in quoted):
            return unreadable(
                text,
                "the instruction has no words; say what to build, for example 'a small circle on the left'",
                self.name,
            )
        if len(quoted.encode()) > MAX_BYTES:
            return unreadable(
                text,
                f"the instruction is too long: {len(text)} characters are more than can be read "
                f"({MAX_BYTES} bytes, about 200 words); say it more briefly",
                self.name,
            )
        reply = self._reply(quoted)
        parse = decide(
            text,
            {slot: {None if a == NONE else a: p for a, p in reply[slot].items()} for slot in SLOTS},
            {},
            {reason: p for reason, p in reply["request"].items() if reason != BUILD},
            self.name,
            self.prompt_sha256,
        )
        return parse if self.backend.gives_probabilities else replace(parse, confidence={})

    def parse_batch(self, texts: Sequence[str]) -> list[Parse]:
        """Parse each of many instructions; errors as in `parse`."""
        return [self.parse(text) for text in texts]

    def _reply(self, quoted: str) -> Reply:
        if self._cache is None:
            return self.backend.ask(self.prompt, quoted)
        reply = self._cache.get(self.backend.identity, self.prompt_sha256, quoted)
        if reply is None:
            reply = self.backend.ask(self.prompt, quoted)
            self._cache.put(self.backend.identity, self.prompt_sha256, quoted, reply)
        return reply
