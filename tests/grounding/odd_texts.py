"""Texts that nobody would say: halves of instructions put together, with words exchanged, doubled, cut and added."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from pathlib import Path

import grounding

_WORDS = (
    "cups mug bowl plate cans block spoon candle box one ones thing everything it them these that".split(),
    ["left", "right", "front", "middle", "near", "left of", "behind", "around", "on", "between", "nearest", "leftmost"],
    "one two three seven 0 100 both all half another 1.5 -2 third last first".split(),
    "then after before first finally next and but instead except bar without with of from by".split(),
)
_ADDED = (
    "exactly", "it", "them", "the one that is", "with the right one", "bar the", "bar the one that is exactly", "its",
    "except", "the other one", "the same", "10 cm", "the one on the", "between the", "either", "not", "the tallest",
    "the second", "of the same colour", "from left to right", "around it", "in a circle", "the rest", "by size",
    "smallest first", "the one nearest the", "taller than", "which is", "two of the", "the flatter one", "that one",
)  # fmt: skip
_ODD = (
    "", " ", "\n", "\x00", "\x1b[31mred cups\x1b[0m", "\u202estup", "\u200b", "\N{LARGE BLUE CIRCLE} cups", "...", "?!",
    "((((", "e\u0301" * 20, "杯子を円に並べて", "поставь чашки в круг", "كوب", "a" * 300, "cups," * 60, "the " * 60,
)  # fmt: skip


def instructions() -> list[str]:
    """Return the texts of all benchmarks of language."""
    folder = Path(grounding.__file__).parent / "benchmark_data"
    files = [path for path in sorted(folder.glob("*.jsonl")) if not path.name.startswith("replies")]
    return [json.loads(line)["text"] for path in files for line in path.read_text(encoding="utf-8").splitlines()]


class OddTexts:
    """A generator of texts.

    Args:
        seed: of what is drawn.
    """

    def __init__(self, seed: int) -> None:
        self.random, self._whole = random.Random(seed), instructions()
        self._changes: Sequence[Callable[[list[str]], list[str]]] = (
            self._halves, self._exchanged, self._exchanged, self._added, self._added, self._cut, self._repeated,
            self._joined, self._turned,
        )  # fmt: skip

    def instruction(self) -> str:
        """Return an instruction of a benchmark."""
        return self.random.choice(self._whole)

    def one(self) -> str:
        """Return a text."""
        if self.random.random() < 0.05:
            return self.random.choice(_ODD)
        words = self.instruction().split()
        for _ in range(self.random.randint(1, 4)):
            words = self.random.choice(self._changes)(words)
        return " ".join(words)

    def phrase(self) -> str:
        """Return a few words as they may stand for objects."""
        if self.random.random() < 0.5:
            words = self.one().split() or [""]
            first = self.random.randrange(len(words))
            return " ".join(words[first : first + self.random.randint(1, 12)])
        return " ".join(self.random.choice(self.random.choice((*_WORDS, _ADDED))) for _ in range(self._number(8) + 1))

    def _number(self, most: int) -> int:
        return self.random.randint(0, most)

    def _halves(self, words: list[str]) -> list[str]:
        other = self.instruction().split()
        return words[: self._number(len(words))] + other[self._number(len(other)) :]

    def _exchanged(self, words: list[str]) -> list[str]:
        pool = self.random.choice(_WORDS)
        alike = [n for n, word in enumerate(words) if word.lower().strip(",.") in pool] or list(range(len(words)))
        return (
            [*words[: (at := self.random.choice(alike))], self.random.choice(pool), *words[at + 1 :]]
            if alike
            else words
        )

    def _added(self, words: list[str]) -> list[str]:
        at = self._number(len(words))
        return [*words[:at], self.random.choice((*_ADDED, *_ODD[:8])), *words[at:]]

    def _cut(self, words: list[str]) -> list[str]:
        at = self._number(len(words))
        return words[:at] if self.random.random() < 0.5 else words[at:]

    def _repeated(self, words: list[str]) -> list[str]:
        at = self._number(len(words))
        return [*words[: at + 3], *words[at : at + 3] * self.random.randint(1, 3), *words[at + 3 :]]

    def _joined(self, words: list[str]) -> list[str]:
        return [*words, self.random.choice((",", "and", ".", "then", "")), *self.instruction().split()]

    def _turned(self, words: list[str]) -> list[str]:
        at = self._number(len(words))
        return [*words[:at], *reversed(words[at : at + 4]), *words[at + 4 :]]
