"""Join labelled instructions of one scene: two wishes about different objects, a remark and a wish, or a wish and the
one that takes it back.

People say more than one thing at once, and few labelled instructions can show in how many ways. What two of them ask
for together, that a remark beside a wish changes nothing, and that the last word counts, follows from their labels.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from grounding.goal_network.vocabulary import NO_GOAL
from grounding.training.goal_lines import GoalLine, LabelError, LabelledGoal, labelled

REMARKS, TAKEN_BACK = 0.45, 0.1  # shares of the draws that join a remark and a wish, and a wish and another instead
_JOINTS = (". ", ". ", "; ", ", and ", ", then ", ". Then ", ". Also, ", ". And ", ", and also ")
_INSTEAD = (" - no, scrap that: ", "... no, wait, rather ", ". Actually no. ", ". No, forget that, ", " ... er, no: ",
            ", no, on second thoughts ", ". Sorry, I meant: ", " or no, better ", ", wait, no, I want ")  # fmt: skip
_NO_STRUCTURES = frozenset("place of, move of, swap of, keep of".split(", "))
_ENDS = re.compile(r"[\s.!?,;:]+$")
_INDICES = re.compile(r"\{([\d,]+)\}")
# Words that speak of what else is there, or of what was said before: they would mean something else.
_DEPENDS = re.compile(
    r"\b(?:rest|others?|everything|all|remain\w*|left|else|it|them|they|that|those|these|this|same|both|too|also|again|"
    r"instead|one|ones)\b",
    re.IGNORECASE,
)


class JoinedInstructions:
    """Instructions that are drawn from two labelled ones.

    Args:
        lines: labelled instructions.
        rng: draws.
    """

    def __init__(self, lines: Sequence[GoalLine], rng: np.random.Generator) -> None:
        self.rng = rng
        self.remarks = [line.text for line in lines if line.label.strip(" .") == "nothing"]
        wishes = [line for line in lines if line.label.strip(" .") not in NO_GOAL]
        self.wishes = [line for line in wishes if "(all)" not in line.label and "keep of" not in line.label]
        self._plain: dict[str, list[GoalLine]] = {}
        for line in self.wishes:
            if not _DEPENDS.search(line.text):
                self._plain.setdefault(line.scene, []).append(line)

    @property
    def possible(self) -> bool:
        """Return whether there is anything to join."""
        return bool(self.wishes) and bool(self.remarks)

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            if (kind := self.rng.random()) < REMARKS:
                joined: tuple[str, str, str] | None = self._remark()
            else:
                joined = self._taken_back() if kind < REMARKS + TAKEN_BACK else self._two()
            if joined is not None:
                try:
                    return labelled(*joined[:2], scene=joined[2])
                except LabelError:
                    continue  # as with more than nine parts

    def _remark(self) -> tuple[str, str, str]:
        """Say a remark before a wish, or after it."""
        wish = self.wishes[self.rng.integers(len(self.wishes))]
        remark = self.remarks[self.rng.integers(len(self.remarks))].strip()
        said = (remark, wish.text.strip()) if self.rng.random() < 0.7 else (wish.text.strip(), remark)
        end = "" if said[0][-1] in ".!?" else "."
        return f"{said[0]}{end} {said[1]}", wish.label, wish.scene

    def _taken_back(self) -> tuple[str, str, str] | None:
        """Say a wish and then, in its place, another one that does not speak of it."""
        wish = self.wishes[self.rng.integers(len(self.wishes))]
        others = [one for one in self._plain.get(wish.scene, []) if one.label != wish.label]
        if not others:
            return None
        other = others[self.rng.integers(len(others))]
        instead = _INSTEAD[self.rng.integers(len(_INSTEAD))]
        return f"{_ENDS.sub('', wish.text)}{instead}{other.text.strip()}", other.label, other.scene

    def _two(self) -> tuple[str, str, str] | None:
        """Say two wishes about different objects, one after the other."""
        one = self.wishes[self.rng.integers(len(self.wishes))]
        others = self._plain.get(one.scene, [])
        if not others:
            return None
        other = others[self.rng.integers(len(others))]
        if _objects(one.label) & _objects(other.label):
            return None
        joint = _JOINTS[self.rng.integers(len(_JOINTS))]
        text = f"{_ENDS.sub('', one.text)}{joint}{other.text.strip()}"
        first = one.label.strip().rstrip(".").strip()
        before = sum(part.strip().partition(" of ")[0] + " of" not in _NO_STRUCTURES for part in first.split(";"))
        second = re.sub(r"structure (\d)", lambda found: f"structure {int(found[1]) + before}", other.label)
        return text, f"{first}; {second}", one.scene


def _objects(label: str) -> set[str]:
    """Return the indices of the objects of a label."""
    return {index for indices in _INDICES.findall(label) for index in indices.split(",")}
