"""Recognise instructions that are not in English, which is the only language that the parsers were taught.

Without this a parser makes something of any words: "bau einen Turm aus den Dosen" became a circle.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from grounding.resolve.attributes import COLOR_WORDS, COMPARATIVES, SUPERLATIVES
from grounding.resolve.function_words import ARRANGING, FUNCTION_WORDS, GENERIC, NOT_OBJECTS, SHAPE_WORDS
from grounding.resolve.lexicon import ADJECTIVES
from grounding.resolve.word_forms import FORMS

_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)*")
_ENGLISH = (
    FUNCTION_WORDS | NOT_OBJECTS | ARRANGING | SHAPE_WORDS | ADJECTIVES
    | {*FORMS, *GENERIC, *COLOR_WORDS, *SUPERLATIVES, *COMPARATIVES, "rim", "ahead", "round", "straight", "tight",
       "stop", "pls", "plz"}
    | set("hmm hm uh um er erm oh ah eh hey hi hello ok okay nope nah yep yup yeah oops wow".split())
)  # fmt: skip
# At least this share of the words has to be everyday English for a text to pass without a closer look.
ENGLISH_SHARE = 0.5
# A text is foreign where English is less likely than this. Of 921 English instructions four are below, all mistyped ...
LEAST_PROBABILITY = 0.06
# ... and pass, because with its typing errors mended a text is English from this share of words and probability on.
MENDED_SHARE, MENDED_PROBABILITY = 0.7, 0.1
_NAMED = 0.35  # the probability from which on the language is named
_NO_LANGUAGE = ("zxx", "und")  # letters without words
LANGUAGES = {
    "af": "Afrikaans", "ar": "Arabic", "bg": "Bulgarian", "ca": "Catalan", "cs": "Czech", "da": "Danish",
    "de": "German", "el": "Greek", "es": "Spanish", "et": "Estonian", "eu": "Basque", "fa": "Persian",
    "fi": "Finnish", "fr": "French", "gl": "Galician", "he": "Hebrew", "hi": "Hindi", "hr": "Croatian",
    "hu": "Hungarian", "id": "Indonesian", "it": "Italian", "ja": "Japanese", "ko": "Korean", "lt": "Lithuanian",
    "lv": "Latvian", "nb": "Norwegian", "nl": "Dutch", "no": "Norwegian", "pl": "Polish", "pt": "Portuguese",
    "ro": "Romanian", "ru": "Russian", "sk": "Slovak", "sl": "Slovenian", "sr": "Serbian", "sv": "Swedish",
    "th": "Thai", "tr": "Turkish", "uk": "Ukrainian", "vi": "Vietnamese", "zh": "Chinese",
}  # fmt: skip


def foreign_language(text: str, mended: Callable[[], str] | None = None) -> str | None:
    """Name the language of a text that is not English; `None` if it is English, or no language at all.

    Args:
        text: an instruction.
        mended: gives the same without typing errors, where they can be mended.

    Returns:
        The language's English name, or "another language" where it is not sure which.
    """
    if _english_share(text) >= ENGLISH_SHARE:
        return None
    ranked = _identifier().rank(text)
    likeliest, probability = ranked[0]
    if likeliest in _NO_LANGUAGE or dict(ranked).get("en", 0.0) >= LEAST_PROBABILITY:
        return None
    without_errors = text if mended is None else mended()
    likely = _english_share(without_errors) >= MENDED_SHARE
    if likely and dict(_identifier().rank(without_errors)).get("en", 0.0) >= MENDED_PROBABILITY:
        return None
    return LANGUAGES.get(likeliest, "another language") if probability >= _NAMED else "another language"


def _english_share(text: str) -> float:
    """Return the share of everyday English words; 1 if there are no words."""
    words = [word.lower().replace("’", "'") for word in _WORD.findall(text)]
    return sum(word in _ENGLISH for word in words) / len(words) if words else 1.0


@lru_cache(maxsize=1)
def _identifier() -> Any:
    from py3langid.langid import MODEL_FILE, LanguageIdentifier

    return LanguageIdentifier.from_model_file(MODEL_FILE, norm_probs=True)
