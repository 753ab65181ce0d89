"""`structagent parse`: instructions to slots, told for people or as one JSON object a line."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TextIO

from agent.errors import exit_code_of, one_sentence
from agent.events import json_value
from agent.telling import number, slot_label
from grounding.embedding_parser import EmbeddingParser, Parse


def read_instructions(
    texts: Sequence[str], as_json: bool, results: TextIO, complain: Callable[[str], None]
) -> int:
    """Parses every instruction, tells what was read, and goes on after one that was not understood.

    Args:
        texts: the instructions.
        as_json: one JSON object a line, with "error" in place of the slots where there is one.
        results: where to tell.
        complain: takes one sentence for every instruction that was not understood.

    Returns:
        How many were not understood.
    """
    parser = EmbeddingParser.from_pretrained()
    not_understood = 0
    for text in texts:
        try:
            parse = parser.parse(text)
        except Exception as error:
            if exit_code_of(error) is None:
                raise
            not_understood += 1
            complain(one_sentence(error))
            if as_json:
                print(json.dumps({"text": text, "error": one_sentence(error)}, ensure_ascii=False), file=results)
            continue
        print(json.dumps(_as_json(parse), ensure_ascii=False) if as_json else _as_text(parse), file=results)
    return not_understood


def _as_json(parse: Parse) -> dict[str, object]:
    return {
        "text": parse.text,
        "spec": parse.spec.to_dict(),
        "confidence": json_value(parse.confidence),
        "evidence": json_value(parse.evidence),
        "parser": parse.parser,
        "dropped": dict(parse.dropped),
    }


def _as_text(parse: Parse) -> str:
    lines = [f"“{parse.text}”"]
    for slot, value in parse.spec.to_dict().items():
        sure = parse.confidence.get(slot)
        note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
        lines.append(f"  {slot_label(slot):<11} {value or 'left open':<14} {note}".rstrip())
    return "\n".join(lines)
