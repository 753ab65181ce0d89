"""Divide an instruction into words, spelled in one way, with the place of each in the text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

_TOKEN = re.compile(
    r"(?<=\d)[-–](?=\d)|(?<![\w.,])[-−]\s?(?=\d|\.\d)|\d+(?:[.,]\d+)?e\d+(?!\w)|\d+(?:[.,]\d+)?|\.\d+|[½¼¾]|[^\W\d_]+(?:['’][^\W\d_]+)*|['’]{2}|[\"”“″'’′]"
    r"|[.,;:!?()\n]|[–—]|(?<=\s)-+(?=\s)|[^\s\w-]"
)
_MINUS = frozenset("-−")
_SPELLING = {
    "centre": "center", "centred": "centered", "centrally": "center", "middlemost": "middle",
    "colours": "colour", "colors": "colour", "color": "colour", "coloured": "colour", "colored": "colour",
    "gray": "grey", "towards": "toward", "besides": "beside", "infront": "in front",
    "ontop": "on top", "nextto": "next to", "inbetween": "in between", "anti": "anti", "lefthand": "left hand",
    "righthand": "right hand", "sidebyside": "side by side", "“": '"', "”": '"', "″": '"', "''": '"', "’": "'",
    "′": "'", "’’": '"', "–": ",", "—": ",", "-": ",", "--": ",", "lineup": "line up", "metres": "m", "meters": "m",
    "metre": "m", "meter": "m", "×": "x", "cms": "cm", "colour's": "colour", "hafl": "half",
}  # fmt: skip
_FRACTIONS = {"½": "0.5", "¼": "0.25", "¾": "0.75"}


@dataclass(frozen=True)
class Words:
    """The words of an instruction, punctuation among them.

    Attributes:
        text: the instruction as it was given.
        words: in small letters, British spelling made American, hyphens taken apart.
        spans: (first, end) characters of each word in `text`.
    """

    text: str
    words: tuple[str, ...]
    spans: tuple[tuple[int, int], ...]

    def word(self, place: int) -> str:
        """Return the word at a place; empty before the first and after the last."""
        return self.words[place] if 0 <= place < len(self.words) else ""

    def quote(self, first: int, end: int) -> str:
        """Return the words of the text as they were written."""
        if first >= end:
            return ""
        return " ".join(self.text[self.spans[first][0] : self.spans[end - 1][1]].split())


@lru_cache(maxsize=256)
def split(text: str) -> Words:
    """Divide a text into words.

    Args:
        text: any string.
    """
    words: list[str] = []
    spans: list[tuple[int, int]] = []
    for match in _TOKEN.finditer(text):
        said = match.group().lower().replace("’", "'") if len(match.group()) > 1 else match.group().lower()
        if said in ("-", "–") and text[match.start() - 1].isdigit() and text[match.end() : match.end() + 1].isdigit():
            said = "to"  # "2-3 cm"
        elif (
            said.strip() in _MINUS
            and match.end() < len(text)
            and (text[match.end()].isdigit() or text[match.end()] == ".")
        ):
            said = "minus"
        elif said.strip("-") == "" or said in _SPELLING:
            said = _SPELLING.get(said, ",")
        elif said in _FRACTIONS:
            said = _FRACTIONS[said]
        elif said.isalpha():
            said = _SPELLING.get(said, said)
        elif said[0].isdigit() or (said[0] == "." and len(said) > 1):
            said = said.replace(",", ".")
            said = f"0{said}" if said[0] == "." else said
        for word in said.split():
            words.append(word)
            spans.append(match.span())
    return Words(text, tuple(words), tuple(spans))


# Words with their apostrophes and hyphens, numbers, and single marks: the pieces that written goals copy.
_PIECE = re.compile(r"\d+(?:[.,]\d+)?|[^\W\d_]+(?:['’-][^\W\d_]+)*|[^\s\w]")


def words_of(text: str) -> list[str]:
    """Divide an instruction into words and marks of punctuation, in small letters."""
    return [match.group().lower() for match in _PIECE.finditer(text)]
