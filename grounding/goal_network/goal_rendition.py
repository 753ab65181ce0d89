"""Render a goal in the words that the goal network writes goals with, so that it can read what is said about the goal.

"so far : tower of the cans , left ; place of the red cup , behind structure 1 . now : put the cup on the can"
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from grounding.goal_network.beam_search import WrittenGoal
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Order, Part, PartReference, RelationPart
from grounding.resolve.attributes import SceneObject
from grounding.resolve.object_names import read_name
from grounding.resolve.tokens import words_of
from grounding.resolve.word_forms import plural

BEFORE, NOW = "so far :", ". now :"
_WAYS = {"ascending": "up", "descending": "down"}


@dataclass(frozen=True)
class ObjectPhrase:
    """A phrase of a rendition.

    Attributes:
        words: "the cans".
        objects: the indices of the objects that it stands for.
    """

    words: str
    objects: tuple[int, ...]


@dataclass(frozen=True)
class Rendition:
    """A goal in words.

    Attributes:
        text: the goal, between `BEFORE` and `NOW`.
        phrases: the place of the first word and the place of the last -> the phrase that stands there.
    """

    text: str
    phrases: dict[tuple[int, int], ObjectPhrase]

    @property
    def known(self) -> dict[str, tuple[int, ...]]:
        """Return the marks of the phrases and their objects; see `mark_at`."""
        return {_mark(place): phrase.objects for place, phrase in self.phrases.items()}

    @property
    def length(self) -> int:
        """Return the number of words."""
        return len(words_of(self.text))

    @property
    def label(self) -> str:
        """Return the line with which the goal is labelled in its own words."""
        return self.text.removeprefix(BEFORE).removesuffix(NOW).replace("( all )", "(all)").strip()

    def mark_at(self, first: int, last: int) -> str | None:
        """Return the mark of the phrase in which the words from `first` to `last` stand; `None` if in none."""
        places = [place for place in self.phrases if place[0] <= first and last <= place[1]]
        return _mark(places[0]) if places else None


def _mark(place: tuple[int, int]) -> str:
    return f"<{place[0]}>"  # no words of an instruction look like this


@dataclass(frozen=True)
class AfterGoal(WrittenGoal):
    """The goal that the network wrote after a goal and what was said about it; phrases of the goal are marks.

    Attributes:
        rendition: of the goal.
    """

    rendition: Rendition

    def phrase(self, place: int) -> str:
        """Return the words, or the mark of a phrase of the goal, that the two actions at this place point at."""
        mark = self.rendition.mark_at(self.actions[place].value, self.actions[place + 1].value)
        return super().phrase(place) if mark is None else mark


def rendition_of(goal: Goal, objects: Sequence[SceneObject]) -> Rendition:
    """Render a goal about the objects of a scene.

    Args:
        goal: its objects are indices.
        objects: of the scene.
    """
    writer = _Rendering(goal, objects)
    writer.say(BEFORE)
    for number, part in enumerate(goal.parts):
        writer.say(";" if number else "")
        writer.part(part)
    writer.say(NOW)
    return Rendition(" ".join(writer.said), writer.phrases)


def object_phrases(indices: Sequence[int], objects: Sequence[SceneObject]) -> list[ObjectPhrase]:
    """Return the phrases that stand for some objects: all of a kind, all of a colour and kind, or one by one."""
    heads = [read_name(each.name).head or "object" for each in objects]
    left, found = list(dict.fromkeys(indices)), list[ObjectPhrase]()
    while left:
        kind = [index for index, head in enumerate(heads) if head == heads[left[0]]]
        named = [index for index in left if index in kind]
        colour = _colour(objects[left[0]])
        alike = [index for index in kind if _colour(objects[index]) == colour]
        if len(kind) == 1:
            words, taken = f"the {heads[left[0]]}", named
        elif set(named) == set(kind):
            words, taken = f"the {plural(heads[left[0]])}", named
        elif colour and len(alike) > 1 and set(alike) <= set(named):
            words, taken = f"the {colour} {plural(heads[left[0]])}", [index for index in named if index in alike]
        elif colour and len(alike) == 1:
            words, taken = f"the {colour} {heads[left[0]]}", left[:1]
        else:
            words, taken = _own_name(objects[left[0]].name), left[:1]
            # A bare noun would stand in "the green cup", too.
            words += " 1" if words == heads[left[0]] else ""
        found.append(ObjectPhrase(words, tuple(taken)))
        left = [index for index in left if index not in taken]
    return found


def _colour(each: SceneObject) -> str:
    return each.attributes.colors[0] if each.attributes is not None and each.attributes.colors else ""


def _own_name(name: str) -> str:
    """Return a name as words: "cup_2" as "cup 2", "object 3, red, tall" as "object 3"."""
    return " ".join(name.split(",")[0].replace("_", " ").split()) or "object"


class _Rendering:
    """Writes words, and remembers where the phrases for objects stand."""

    def __init__(self, goal: Goal, objects: Sequence[SceneObject]) -> None:
        self.objects = objects
        structures = [number for number, part in enumerate(goal.parts) if not isinstance(part, RelationPart)]
        self.number_of = {number: place + 1 for place, number in enumerate(structures)}
        self.said: list[str] = []
        self.phrases: dict[tuple[int, int], ObjectPhrase] = {}

    def say(self, words: str) -> None:
        if words:
            self.said += words_of(words)

    def group(self, objects: Objects | None, one_by_one: bool = False) -> None:
        if objects is None:
            self.say("(all)")
        elif isinstance(objects, PartReference):
            self.say(f"structure {self.number_of[objects.part]}")
        elif objects and isinstance(objects[0], str):
            self.say(" + ".join(map(str, objects)))
        else:
            groups = [(index,) for index in objects] if one_by_one else [objects]
            phrases = [phrase for group in groups for phrase in object_phrases(group, self.objects)]  # type: ignore[arg-type]
            for number, phrase in enumerate(phrases):
                self.say("+" if number else "")
                first = len(self.said)
                self.say(phrase.words)
                self.phrases[first, len(self.said) - 1] = phrase

    def part(self, part: Part) -> None:
        if isinstance(part, RelationPart):
            self.relation(part)
            return
        self.say(f"{part.shape or 'structure'} of")
        listed = part.order is not None and part.order.by == "listed"
        self.group(part.objects, one_by_one=listed)
        for slot, value in part.spec.tokens():
            if slot != "shape":
                self.say(f", facing {value}" if slot == "rotation" else f", {value}")
        for key, value in part.keys.items():
            self.key(key, value)

    def key(self, key: str, value: object) -> None:
        if isinstance(value, Order):
            way = _WAYS.get(value.direction or "", "")
            self.say(f", order {value.by} {way} {f'from {value.start}' if value.start else ''}")
        elif key == "around":
            self.say(", around")
            self.group(value)  # type: ignore[arg-type]
        elif isinstance(value, float):
            self.say(f", {key} {in_centimetres(value)}")
        else:
            self.say(f", {'group' if key == 'group_by' else key} {value}")

    def relation(self, part: RelationPart) -> None:
        if part.relation in ("moved", "swapped"):
            self.say("move of" if part.relation == "moved" else "swap of")
            self.group(part.objects)
            self.say(f", {part.direction} {in_centimetres(part.distance or 0.0)}" if part.direction else "")
            return
        self.say("place of")
        self.group(part.objects)
        if part.relation == "at":
            self.say(f", at {part.x_position or ''} {part.y_position or ''}")
            return
        self.say(f", {'inside' if part.relation == 'in' else part.relation}")
        self.group(part.reference)
        self.say(f", distance {in_centimetres(part.distance)}" if part.distance is not None else "")


def in_centimetres(metres: float) -> str:
    """Return a length in words."""
    return f"{metres * 100:.4g} cm"
