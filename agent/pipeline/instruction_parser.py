"""Configure the interpretation of instructions: the options, and the interpreter made from them."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grounding.goal_network.writer import NetworkWriter
    from grounding.goal_reading.reader import GoalReader
    from grounding.interpreter import Interpreter
    from grounding.llm_goals.reader import GoalWriter, LLMGoalReader
    from grounding.parse_result import Parser
    from grounding.parsers.llm_endpoint import EndpointLLM
    from grounding.parsers.llm_reply import Backend
    from grounding.parsers.sentence_encoder import SentenceEncoder


@dataclass(frozen=True)
class ReadingOptions:
    """How instructions are read.

    Attributes:
        parser: "embedding" or "llm".
        viewpoint: whose left and right is meant, "robot" or "opposite".
        llm_model: a folder or a name of the local model, or the endpoint's name for it; `None` for the default.
        llm_url: an OpenAI-compatible endpoint; `None` for the local model.
        replies: a file in which the LLM's replies are kept, and found again; not an endpoint's about goals.
        encoder: a folder or a name of the embedding parser's sentence encoder; `None` for the built-in one. Nouns and
            the planners' sentences stay with the built-in one, with which their threshold and weights were made.
        key_url: the endpoint that the user named by a flag, in the environment or in the own file. The key is sent to
            its host and nowhere else, whatever endpoint a batch's row or a project's file names.
    """

    parser: str = "embedding"
    viewpoint: str = "robot"
    llm_model: str | None = None
    llm_url: str | None = None
    replies: Path | None = None
    key_url: str | None = None
    encoder: str | None = None


def make_interpreter(
    options: ReadingOptions, encoder: SentenceEncoder | None = None, strict: bool = False
) -> Interpreter:
    """Make the interpreter for the options; nothing is loaded before its first use.

    Args:
        options: how instructions are interpreted.
        encoder: share a loaded built-in one.
        strict: raise the LLM's errors instead of falling back to the embedding parser.
    """
    from grounding.interpreter import Interpreter  # a chat reads its first sentence after its prompt
    from grounding.parsers.sentence_encoder import SentenceEncoder

    encoder = encoder or SentenceEncoder()

    def embedding() -> Parser:
        from grounding.parsers.embedding import EmbeddingParser

        if options.encoder is not None:
            from grounding.parsers.named_encoder import NamedEncoder, open_encoder

            named = open_encoder(options.encoder)
            if isinstance(named, NamedEncoder):
                from grounding.training.encoder_heads import parser_on

                return parser_on(named, report=_report)
        return EmbeddingParser.from_pretrained(encoder=encoder)

    def endpoint() -> EndpointLLM:
        from grounding.parsers.llm_endpoint import EndpointLLM, same_host

        assert options.llm_url is not None
        trusted = options.key_url is not None and same_host(options.llm_url, options.key_url)
        return EndpointLLM(options.llm_url, options.llm_model or "default", send_key=trusted, report=_report)

    def llm() -> Parser:
        from grounding.parsers.llm import LLMParser
        from grounding.parsers.llm_cache import ReplyCache

        if options.llm_url is None:
            from grounding.parsers.llm_local import LocalLLM

            backend: Backend = LocalLLM(options.llm_model)
        else:
            backend = endpoint()
        return LLMParser(backend, cache=ReplyCache(options.replies) if options.replies else None)

    def goals() -> GoalWriter:
        if options.llm_url is None:
            from grounding.llm_goals.local import LocalGoals, LocalGoalWriter

            return LocalGoalWriter(LocalGoals(options.llm_model), options.replies)
        from grounding.llm_goals.endpoint import EndpointGoals

        return EndpointGoals(endpoint())

    def goal_reader(grammar: GoalReader) -> LLMGoalReader:
        from grounding.llm_goals.reader import LLMGoalReader

        return LLMGoalReader(goals, grammar, encoder, options.viewpoint == "opposite")

    @cache
    def network() -> NetworkWriter:
        from grounding.goal_network.writer import NetworkWriter

        return NetworkWriter.from_pretrained(encoder)

    def corrector() -> NetworkWriter:
        from grounding.goal_network.writer import CORRECTIONS, NetworkWriter

        return NetworkWriter.from_pretrained(encoder, CORRECTIONS)

    default = Interpreter(embedding, None, options.viewpoint, encoder, network=network, corrector=corrector)
    if options.parser == "embedding":
        return default
    fallback = None if strict else lambda: default.parser
    return Interpreter(llm, fallback, options.viewpoint, encoder, goal_reader, network, corrector, default)


def _report(line: str) -> None:
    print(f"structagent: {line}", file=sys.stderr, flush=True)
