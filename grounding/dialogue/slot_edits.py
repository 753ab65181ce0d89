"""Change a specification slot by slot, and collect notes and questions about the changes."""

from __future__ import annotations

from dataclasses import replace

from grounding.dialogue.relative_edits import Edit
from grounding.parse_result import Parse, Question
from grounding.spec import LEGAL_VALUES, SLOTS, SLOTS_OF_SHAPE, X_POSITIONS, Y_POSITIONS, StructureSpec
from grounding.structure_words import STRUCTURES

_SLOTS_OF_PLACE = ("x_position", "y_position")
_CLOCKWISE = ("north", "east", "south", "west")
_OPPOSITE = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}
_WITH_OPENING = ("arc", "triangle")
_SLOT_NAMES = {"x_position": "position from left to right", "y_position": "position in depth"}
# Value -> how it is said of a structure.
_SAID = {
    "left": "on the left", "right": "on the right", "center": "in the center", "top": "at the back",
    "middle": "halfway back", "bottom": "at the front", "small": "small", "medium": "of medium size",
    "large": "large",
}  # fmt: skip
_ENDS = {
    "small": "the smallest size", "large": "the largest size", "left": "as far left as it goes",
    "right": "as far right as it goes", "top": "as far back as it goes", "bottom": "as near as it goes",
}  # fmt: skip


def changed_slots(last: StructureSpec, spec: StructureSpec) -> tuple[str, ...]:
    """List the slots in which two specifications differ."""
    return tuple(slot for slot in SLOTS if getattr(last, slot) != getattr(spec, slot))


def loses_direction(before: str | None, after: str | None) -> bool:
    """Return whether a structure loses what faces somewhere when its shape changes: the open side, or the point."""
    return before != after and before in _WITH_OPENING


class Editing:
    """A specification while it is being changed.

    Attributes:
        spec: as it is now.
        notes: what has to be said about the changes.
        question: what has to be asked, the last one if there are several.

    Args:
        last: what was asked for.
        stands: what the arrangement that was shown realises, as spoken: relative changes of what nobody asked for
            start from it. `None` where nothing was shown.
    """

    def __init__(self, last: StructureSpec, stands: StructureSpec | None = None) -> None:
        self.spec = last
        self._last, self._stands = last, stands
        self._ends: dict[str, str] = {}  # what was shown and is at an end already, though nobody asked for it
        self.notes: list[str] = []
        self.question: Question | None = None

    def absolute(self, parse: Parse) -> None:
        """Apply what the parser found, the shape first."""
        values = {slot: value for slot, value in parse.spec.to_dict().items() if value is not None}
        shape = values.pop("shape", self.spec.shape)
        legal = SLOTS_OF_SHAPE[shape]
        lost = [slot for slot in SLOTS[1:] if getattr(self.spec, slot) is not None and slot not in legal]
        if lost:
            self.notes.append(f"a {shape} has no {' and no '.join(lost)}: dropped")
        if loses_direction(self.spec.shape, shape) and self.spec.rotation and "rotation" not in (*lost, *values):
            self.notes.append(f"a {shape} has nothing that faces {self.spec.rotation}: dropped")
            lost.append("rotation")
        self.spec = replace(self.spec, shape=shape, **dict.fromkeys(lost))
        for slot, value in values.items():
            self._set(slot, value)
        self.notes += [f"a {shape} has no {slot}" for slot in parse.dropped if slot not in legal]

    def relative(self, edits: list[Edit]) -> None:
        """Apply the relative changes; of several to one slot the last one counts."""
        latest = {edit.slot: edit for edit in edits if edit.how == "keep"}
        latest |= {edit.slot: edit for edit in edits if edit.how != "keep"}
        for edit in latest.values():
            if edit.how == "keep":
                self.notes.append(f"the {_SLOT_NAMES.get(edit.slot, edit.slot)} stays as it is")
            elif edit.how == "not":
                self._not(edit)
            elif edit.slot == "position":
                for slot in _SLOTS_OF_PLACE:
                    self._set(slot, None)
            elif edit.slot in ("side", "end", "corner"):
                self._other(edit.slot)
            elif edit.slot == "elsewhere":
                self._ask("x_position", "where", tuple(v for v in X_POSITIONS if v != self._now("x_position")))
            elif edit.slot == "height":
                self.notes.append("how high it gets follows from the objects")
            elif edit.slot == "center":
                self._to_center()
            elif edit.slot not in SLOTS_OF_SHAPE[self.spec.shape]:
                self.notes.append(f"a {self.spec.shape} has no {edit.slot}")
            elif edit.how == "clear":
                self._set(edit.slot, None)
            elif edit.slot == "rotation":
                self._turn(edit)
            else:
                self._step(edit)

    def keep_ends(self, objects_change: bool) -> None:
        """Specify what was "already the smallest" where something else changes, so that it stays so.

        Args:
            objects_change: whether other objects take part.
        """
        if objects_change or self.spec != self._last:
            self.spec = replace(self.spec, **self._ends)

    def _set(self, slot: str, value: str | None) -> None:
        if value is not None and slot not in SLOTS_OF_SHAPE[self.spec.shape]:
            self.notes.append(f"a {self.spec.shape} has no {slot}")
            return
        self.spec = replace(self.spec, **{slot: value})

    def _now(self, slot: str) -> str | None:
        """Return the value of the slot, otherwise that of the shown arrangement."""
        said = getattr(self.spec, slot)
        if said is not None or self._stands is None:
            return said
        # The size of a circle says nothing about that of a line.
        same = self.spec.shape == self._last.shape or slot in _SLOTS_OF_PLACE
        return getattr(self._stands, slot) if same else None

    def _unsaid(self, slot: str) -> bool:
        """Return whether the slot's present value was shown, not asked for."""
        return getattr(self.spec, slot) is None and self._now(slot) is not None

    def _change(self, slot: str, value: str) -> None:
        """Set a slot, and note the shown value if nobody had asked for it."""
        if self._unsaid(slot):
            name, was, now = _SLOT_NAMES.get(slot, slot), _SAID[self._now(slot) or ""], _SAID[value]
            self.notes.append(f"no {name} was asked for, and the proposal was {was}; now asked for: {now}")
        self._set(slot, value)

    def _not(self, edit: Edit) -> None:
        """Leave a value: if it was asked for, open the slot; if it was only shown, ask for another place."""
        value = LEGAL_VALUES[edit.slot][edit.by or 0]
        if getattr(self.spec, edit.slot) == value:
            self._set(edit.slot, None)
        elif self._now(edit.slot) == value:
            others = tuple(v for v in LEGAL_VALUES[edit.slot] if v != value)
            self._ask(edit.slot, f"it is {_SAID[value]} so far; where should it be", others)

    def _step(self, edit: Edit) -> None:
        values, now = LEGAL_VALUES[edit.slot], self._now(edit.slot)
        by = edit.by or 0
        last = values[-1] if by > 0 else values[0]
        if now == last:
            if self._unsaid(edit.slot):
                self._ends[edit.slot] = last
            self.notes.append(f"it is already {_SAID[last]}, {_ENDS[last]}")
        elif now is None or edit.how == "most":
            self._change(edit.slot, last)
        else:
            self._change(edit.slot, values[values.index(now) + by])

    def _turn(self, edit: Edit) -> None:
        now = self._now("rotation")
        quarters = 2 if edit.how == "flip" else edit.by
        structure = STRUCTURES[self.spec.shape] if self.spec.shape else None
        if quarters is None:
            self._ask("rotation", "it can be turned by quarters only; which way should it face", _CLOCKWISE)
        elif quarters % 4 == 0:
            self.notes.append("a full turn changes nothing")
        elif now is not None and structure and structure.half_turn and quarters % 2 == 0:
            self.notes.append(structure.half_turn)
        elif now is None and structure and structure.unrotated and self._stands is not None:
            self._ask("rotation", structure.unrotated, _CLOCKWISE)
        elif now is None:
            self._ask("rotation", "it has faced no particular way so far; which way should it face", _CLOCKWISE)
        else:
            turned = _CLOCKWISE[(_CLOCKWISE.index(now) + quarters) % 4]
            unsaid = self._unsaid("rotation")
            self._set("rotation", turned)
            if edit.how == "turn" or unsaid:
                sense = "half a turn" if quarters % 4 == 2 else f"{'anti' if quarters < 0 else ''}clockwise"
                before = f"; no rotation was asked for, and the proposal faced {now}" if unsaid else ""
                self.notes.append(f"turned {sense}, seen from above: it faces {turned}{before}")

    def _other(self, kind: str) -> None:
        """Change to the other side (left and right), end (near and far, if known) or corner (both)."""
        places = {slot: self._now(slot) for slot in _SLOTS_OF_PLACE}
        flips = [slot for slot in _SLOTS_OF_PLACE if places[slot] in _OPPOSITE]
        if kind == "side":
            flips = [slot for slot in flips if slot == "x_position"]
        elif kind == "end" and len(flips) == 2:
            flips = ["y_position"]
        elif kind == "corner" and len(flips) < 2:
            flips = []
        if not flips:
            slot = "y_position" if kind == "end" else "x_position"
            options = (Y_POSITIONS if kind == "end" else X_POSITIONS)[::2]
            where = " and ".join(_SAID[value] for value in places.values() if value) or "nowhere in particular"
            self._ask(slot, f"it is {where} so far; which {kind}", options)
        for slot in flips:
            self._change(slot, _OPPOSITE[places[slot]])

    def _to_center(self) -> None:
        x, y = self._now("x_position"), self._now("y_position")
        if x == "center" and y in (None, "middle"):
            self.notes.append("it is already in the center")
        elif x == "center" or (x is None and y is not None):
            self._change("y_position", "middle")
        else:
            self._change("x_position", "center")

    def _ask(self, slot: str, why: str, options: tuple[str, ...]) -> None:
        said = ", ".join(options[:-1]) + f" or {options[-1]}"
        self.question = Question(slot, f"{why}: {said}?", options)
