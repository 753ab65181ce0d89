"""`structagent parse`: instructions to slots, told for people or as one JSON object a line."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from agent.telling import number, slot_label
from grounding.reading import Reader, Reading
from grounding.spec import SLOTS

# How many instructions are read at once: among 128 there are enough of one length to be read together without
# padding, and they take less than a second.
AT_ONCE = 128

if TYPE_CHECKING:
    from grounding.encoder import SentenceEncoder
    from grounding.llm_reply import Backend
    from grounding.parse import Parser


@dataclass(frozen=True)
class ReadingOptions:
    """How instructions are read.

    Attributes:
        parser: "embedding" or "llm".
        viewpoint: whose left and right is meant, "robot" or "opposite".
        llm_model: a folder or a name of the local model, or the endpoint's name for it; `None` for the default.
        llm_url: an OpenAI-compatible endpoint; `None` for the local model.
        replies: a file in which the LLM's replies are kept, and found again.
        key_url: the endpoint that the user named by a flag, in the environment or in the own file. The key is sent to
            its host and nowhere else, whatever endpoint a batch's row or a project's file names.
    """

    parser: str = "embedding"
    viewpoint: str = "robot"
    llm_model: str | None = None
    llm_url: str | None = None
    replies: Path | None = None
    key_url: str | None = None


def make_reader(options: ReadingOptions, encoder: SentenceEncoder | None = None, strict: bool = False) -> Reader:
    """The reader that the options ask for; nothing is loaded before it reads.

    Args:
        options: how to read.
        encoder: share a loaded one.
        strict: let the LLM's errors out instead of falling back to the embedding parser.
    """
    from grounding.encoder import SentenceEncoder

    encoder = encoder or SentenceEncoder()

    def embedding() -> Parser:
        from grounding.embedding_parser import EmbeddingParser

        return EmbeddingParser.from_pretrained(encoder=encoder)

    def llm() -> Parser:
        from grounding.llm_cache import ReplyCache
        from grounding.llm_parser import LLMParser

        if options.llm_url is None:
            from grounding.llm_local import LocalLLM

            backend: Backend = LocalLLM(options.llm_model)
        else:
            from grounding.llm_endpoint import EndpointLLM, same_host

            trusted = options.key_url is not None and same_host(options.llm_url, options.key_url)
            backend = EndpointLLM(options.llm_url, options.llm_model or "default", send_key=trusted)
        return LLMParser(backend, cache=ReplyCache(options.replies) if options.replies else None)

    if options.parser == "embedding":
        return Reader(embedding, None, options.viewpoint, encoder)
    return Reader(llm, None if strict else embedding, options.viewpoint, encoder)


def read_instructions(
    texts: Iterable[Sequence[str]],
    options: ReadingOptions,
    names: Sequence[str] | None,
    as_json: bool,
    results: TextIO,
    complain: Callable[[str], None],
) -> tuple[int, int]:
    """Reads every instruction, tells what was read as soon as it is, and goes on after one that is refused.

    Args:
        texts: the instructions, as many at a time as are there; at most `AT_ONCE` of them are read together. None is
            kept, so that the memory does not grow with them.
        options: how to read them.
        names: of the objects on the table, where they are known.
        as_json: one JSON object a line.
        results: where to tell.
        complain: takes one sentence for every instruction that was refused, and one for a fallback.

    Returns:
        How many were read, and how many were refused.
    """
    reader, read, refused, told = make_reader(options), 0, 0, ""
    at_once = 1 if options.parser == "llm" else AT_ONCE  # a language model reads one by one, and takes seconds
    if options.parser == "embedding":
        import torch

        torch.set_num_threads(1)  # the tensors are too small to share; threads would wait for each other
    for given in texts:
        for start in range(0, len(given), at_once):
            for reading in reader.read_many(given[start : start + at_once], names):
                if reading.fallback and reading.fallback != told:
                    told = reading.fallback
                    complain(told)
                print(json.dumps(reading.to_dict(), ensure_ascii=False) if as_json else _as_text(reading), file=results)
                read += 1
                if reading.status == "refused":
                    refused += 1
                    complain(reading.message)
            results.flush()
    return read, refused


def _as_text(reading: Reading) -> str:
    lines = [f"“{reading.parse.text}”"]
    if reading.status == "refused":
        return "\n".join([*lines, "  refused"])
    for slot in SLOTS:
        value = getattr(reading.spec, slot)
        sure = reading.parse.confidence.get(slot)
        words = reading.parse.evidence.get(slot, ())
        note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
        note += f", by {' '.join(words)!r}" if words else ""
        lines.append(f"  {slot_label(slot):<11} {value or 'left open':<14} {note.removeprefix(', ')}".rstrip())
    lines.append(f"  {'objects':<11} {'everything' if reading.objects is None else ', '.join(reading.objects)}")
    if reading.viewpoint != "robot":
        lines.append(f"  {'viewpoint':<11} {reading.viewpoint}")
    if reading.message:
        lines.append(f"  {'question' if reading.status == 'ask' else 'note':<11} {reading.message}")
    return "\n".join(lines)
