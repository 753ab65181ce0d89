"""Configure the interpretation of instructions: the options, and the interpreter made from them."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grounding.interpreter import Interpreter
    from grounding.language_model.goal_model import GoalModel
    from grounding.parse_result import Parser
    from grounding.parsers.llm_endpoint import EndpointLLM
    from grounding.parsers.llm_reply import Backend
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from grounding.verify.verifier import Verifier


@dataclass(frozen=True)
class ReadingOptions:
    """How instructions are read.

    Attributes:
        parser: "embedding" or "llm".
        viewpoint: whose left and right is meant, "robot" or "opposite".
        llm_model: a folder or a name of the local model, or the endpoint's name for it; `None` for the default.
        llm_url: an OpenAI-compatible endpoint; `None` for the local model.
        replies: a file in which the LLM's replies are kept, and found again; not an endpoint's about goals.
        key_url: the endpoint that the user named by a flag, in the environment or in the own file. The key is sent to
            its host and nowhere else, whatever endpoint a batch's row or a project's file names.
        like: the name of the figure that instructions speak of as "the same"; "" for none.
        accept_drawings: whether a run builds what an endpoint drew without asking.
        like_always: whether every instruction is about it, as in a run; in a chat only those are that say so.
    """

    parser: str = "embedding"
    viewpoint: str = "robot"
    llm_model: str | None = None
    llm_url: str | None = None
    replies: Path | None = None
    key_url: str | None = None
    like: str = ""
    accept_drawings: bool = False
    like_always: bool = True


def make_interpreter(
    options: ReadingOptions, encoder: SentenceEncoder | None = None, strict: bool = False
) -> Interpreter:
    """Make the interpreter for the options; nothing is loaded before its first use.

    Args:
        options: how instructions are interpreted.
        encoder: share a loaded one.
        strict: raise the language model's errors instead of reading without it.
    """
    from grounding.goal_network.writer import NetworkWriter
    from grounding.interpreter import Interpreter  # a chat reads its first sentence after its prompt
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from grounding.propose.network import NetworkProposer

    encoder = encoder or SentenceEncoder()

    def embedding() -> Parser:
        from grounding.parsers.embedding import EmbeddingParser

        return EmbeddingParser.from_pretrained(encoder=encoder)

    def verifier() -> Verifier:
        from grounding.verify.verifier import Verifier

        return Verifier.from_pretrained(encoder)

    def endpoint() -> GoalModel:
        from grounding.language_model.goal_model import GoalModel

        return GoalModel(_endpoint(options))

    network = NetworkProposer(lambda: NetworkWriter.from_pretrained(encoder), options.like, options.like_always)
    on_this_machine = options.parser == "llm" and options.llm_url is None
    slots = partial(make_slot_parser, options) if on_this_machine else embedding
    model = endpoint if options.parser == "llm" and not on_this_machine else None
    return Interpreter(slots, encoder, network, verifier, options.viewpoint, model, None if strict else embedding)


def make_slot_parser(options: ReadingOptions) -> Parser:
    """Make the parser that asks a language model for the five slots with the paper's few-shot prompt."""
    from grounding.parsers.llm import LLMParser
    from grounding.parsers.llm_cache import ReplyCache
    from grounding.parsers.llm_local import LocalLLM

    backend: Backend = LocalLLM(options.llm_model) if options.llm_url is None else _endpoint(options)
    return LLMParser(backend, cache=ReplyCache(options.replies) if options.replies else None)


def _endpoint(options: ReadingOptions) -> EndpointLLM:
    from grounding.parsers.llm_endpoint import EndpointLLM, same_host

    assert options.llm_url is not None
    trusted = options.key_url is not None and same_host(options.llm_url, options.key_url)
    return EndpointLLM(options.llm_url, options.llm_model or "default", send_key=trusted, report=_report)


def _report(line: str) -> None:
    print(f"structagent: {line}", file=sys.stderr, flush=True)
