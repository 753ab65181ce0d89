"""Read what a language model says from a server's chat completion, without what it thinks."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from grounding.untrusted_files import GivenTwiceError, each_key_once

# A tag of one word that is about thinking, in any of the brackets that models use: <think>, </thinking>, [/THINK],
# <|END_THINKING|>, <seed:think>. A channel is a tag, too, also where its marks were taken for control characters and
# left out: all channels but "final" hold thoughts.
_TAG = re.compile(
    r"[<\[◁]\|?(?P<end>/|end[_▁](?:of[_▁])?)?[\w:]{0,20}"
    r"(?:think|thought|reason|reflect|analysis|scratchpad)\w{0,20}\|?[>\]▷]"
    r"|<\|channel\|?>\s*(?P<channel>\w+)(?:\s*<\|message\|>)?"
    r"|(?P<closed><channel\|>|assistantfinal)"
    r"|\A(?-i:analysis(?=[A-Z]))",
    re.IGNORECASE,
)
_CONTROL = re.compile(r"<\|(?:return|end|im_end|eot_id|endoftext)\|>\s*\Z")


class CompletionError(ValueError):
    """An answer that is no chat completion; the message is meant to follow the server's name."""


@dataclass(frozen=True)
class Completion:
    """One choice of a chat completion.

    Attributes:
        text: what the model says, without its thoughts; empty where it says nothing.
        finish: why it ended, as the server names it: "stop", "length", "content_filter"; empty where it is not said.
        refused: whether the model declined to answer.
    """

    text: str
    finish: str = ""
    refused: bool = False


def read_completion(answer: bytes) -> Completion:
    """Read the first choice of a completion, or of its stream.

    Raises:
        CompletionError: for anything else.
    """
    try:
        choice = _choice(answer)
    except GivenTwiceError as error:
        raise CompletionError("answered with a JSON object in which a key is given twice") from error
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        if answer.lstrip()[:1] == b"<":
            raise CompletionError(
                "answered with something other than a chat completion: a web page, such as that of a log-in or a proxy"
            ) from error
        if answer.startswith(_GZIP):
            raise CompletionError("answered with compressed bytes, which were not asked for") from error
        if _is_error(answer):
            raise CompletionError("answered with an error, under status 200, in place of a completion") from error
        raise CompletionError("answered with something other than a chat completion") from error
    message, finish = choice
    content = message.get("content")
    reasoning = next((message[key] for key in _REASONING if message.get(key)), None)
    refusal = message.get("refusal") or any(isinstance(part, dict) and part.get("refusal") for part in _parts(content))
    if not isinstance(content, (str, list)) and not (finish and "content" in message) and not reasoning and not refusal:
        raise CompletionError("answered with something other than a chat completion")
    thoughts, text = split_thoughts(_joined(content))
    if not text and finish != "length":
        # Some servers take a model's whole answer for its thoughts. Only what is an answer and nothing else is one.
        text = next((each for each in (_joined(reasoning), thoughts) if _is_json(each)), "")
    return Completion(text, finish, bool(refusal))


_GZIP = b"\x1f\x8b"


def _is_error(answer: bytes) -> bool:
    """Tell whether an answer is the JSON object of an error, as proxies send it under status 200."""
    try:
        said = json.loads(answer)
    except (ValueError, RecursionError):
        return False
    return isinstance(said, dict) and bool(said.get("error") or said.get("detail"))


_REASONING = ("reasoning_content", "reasoning", "thinking")  # beside the content


def split_thoughts(said: str) -> tuple[str, str]:
    """Separate what a model thinks from what it says after that.

    Thoughts reach up to the last end of thinking, whether or not their beginning is there. Thoughts without an end
    reach up to the end of the text.
    """
    end, opened = 0, len(said)
    for tag in _TAG.finditer(said):
        closes = tag["end"] or tag["closed"] or (tag["channel"] or "").lower() == "final"
        if closes:
            end, opened = tag.end(), len(said)
        else:
            opened = min(opened, tag.start())
    spoken = _CONTROL.sub("", said[end:opened])
    return _TAG.sub("", said[:end]).strip(), spoken.strip()


def _choice(answer: bytes) -> tuple[Mapping[str, Any], str]:
    """Return the message and the finish reason of the first choice; join the pieces of a stream."""
    if not answer.lstrip().startswith((b"data:", b"event:", b":")):
        choice = json.loads(answer, object_pairs_hook=each_key_once)["choices"][0]
        if not isinstance(choice["message"], dict):
            raise ValueError("a message is an object")
        return choice["message"], _word(choice.get("finish_reason"))
    message: dict[str, str] = {}
    finish = ""
    for line in answer.decode("utf-8").split("\n"):
        if not line.startswith("data:") or line[5:].strip() == "[DONE]":
            continue
        for choice in json.loads(line[5:], object_pairs_hook=each_key_once).get("choices", [])[:1]:
            finish = _word(choice.get("finish_reason")) or finish
            for key in ("content", "refusal", *_REASONING):
                if piece := _joined((choice.get("delta") or {}).get(key)):
                    message[key] = message.get(key, "") + piece
    if not message:
        raise ValueError("a stream without a message")
    return message, finish or "stop"


def _word(finish: object) -> str:
    return finish if isinstance(finish, str) else ""


def _parts(content: object) -> Iterator[object]:
    yield from content if isinstance(content, list) else [content]


def _joined(content: object) -> str:
    """Join a content's texts; parts of other kinds are not said."""
    texts = (
        part.get("text") if isinstance(part, dict) and part.get("type", "text") in ("text", "output_text") else part
        for part in _parts(content)
    )
    return "".join(text for text in texts if isinstance(text, str))


def _is_json(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False
