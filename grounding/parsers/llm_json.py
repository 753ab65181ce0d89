"""Read JSON that a language model wrote, and quote of it only what discloses nothing."""

from __future__ import annotations

import json
import re
from collections.abc import Collection
from typing import Any

from grounding.parsers.llm_reply import ANSWERS, NONE
from grounding.untrusted_files import GivenTwiceError, each_key_once

MAX_CONTENT = 12_000  # characters of what the model says


def json_object(content: str) -> dict[str, Any]:
    """Find the one JSON object in a model's reply, whatever is around it.

    Raises:
        ValueError: for none or several, a key that is given twice, or a reply that is too long.
    """
    if len(content) > MAX_CONTENT:
        raise ValueError(f"it is {len(content)} characters long")
    found = []
    decoder = json.JSONDecoder(object_pairs_hook=each_key_once)
    at = content.find("{")
    while at >= 0:
        try:
            value, end = decoder.raw_decode(content, at)
            found.append(value)
        except GivenTwiceError:
            raise
        except (ValueError, RecursionError):
            end = at + 1
        at = content.find("{", end)
    if len(found) != 1:
        raise ValueError(f"it holds {'several JSON objects' if found else 'no JSON object'}")
    return found[0]


def read_answers(content: str, secrets: Collection[str] = ()) -> dict[str, str]:
    """Read question -> legal answer from a model's reply: one JSON object, whatever is around it.

    Args:
        content: what it said.
        secrets: what no message may hold, in any spelling.

    Raises:
        ValueError: for none or several objects, or anything in it that is not legal.
    """
    said = json_object(content)
    if set(said) != set(ANSWERS):
        wrong = sorted(set(said) ^ set(ANSWERS))[0]
        raise ValueError(f"{brief(wrong, secrets)} is {'missing' if wrong in ANSWERS else 'no question'}")
    for question, answer in said.items():
        if answer is None and NONE in ANSWERS[question]:
            said[question] = NONE
        elif not isinstance(answer, str) or answer not in ANSWERS[question] or answer == NONE:
            raise ValueError(f"{question} cannot be {brief(answer, secrets)}")
    return said


def brief(value: object, secrets: Collection[str]) -> str:
    """Format a value of the model for a message, verbatim only if it is a few plain words without a secret."""
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, str):
        words = " ".join(value.split())
        if re.fullmatch(r"[A-Za-z_ ]{1,30}", words) and not any(shares_secret(words, secret) for secret in secrets):
            return json.dumps(words)
        return f"a text of {len(value)} characters"
    return "a list" if isinstance(value, list) else "an object" if isinstance(value, dict) else "a number"


def shares_secret(words: str, secret: str) -> bool:
    """Return whether the words have four letters in a row that the secret has too, forwards or backwards."""
    said, hidden = (re.sub(r"[^a-z]", "", text.lower()) for text in (words, secret))
    run = min(4, len(hidden))
    pieces = (said[at : at + run] for at in range(len(said) - run + 1))
    return run > 0 and any(piece in hidden or piece in hidden[::-1] for piece in pieces)
