"""Collect facts about the objects on the table (colour, size, place), and match phrases with objects."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from agent import events
from agent.perception.color_names import color_word_in_picture
from agent.perception.description import oriented_box, shape_words
from agent.rendering.text import place, with_indefinite_article
from agent.reporting.event_text import describe_object
from grounding.dialogue.act_words import COLORS
from grounding.resolve.errors import ResolveError
from grounding.resolve.function_words import ORDINALS
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.object_names import adjective, rivals
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import plural, singular
from structdiffusion.footprints import stands_above

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder
    from structdiffusion.observation import ObjectCloud, Scene

_ANY = frozenset(
    "it they them those these that this all everything object objects thing things item items one ones stuff".split()
)
_THIRDS = ("left", "center", "right"), ("near you", "halfway back", "far from you")


@dataclass(frozen=True)
class Fact:
    """The facts of one object on the table.

    Attributes:
        name, noun: "cup 2", and "cup".
        display_name: its name with all the words that describe it: "cup 2, red, tall".
        color: the name of its colour, or empty if the colour was not seen.
        position: (x, y, z) of its cloud's mean, world frame, metres.
        sides: length and width as seen from above, and height, metres.
        place: its place from the speaker's viewpoint: "on the left, near you".
        outline: its outline from above, world frame, metres.
        on: the name of the object that it stands on, or empty.
        confidence: in its noun, if that comes from the picture.
        viewpoint: the speaker's, "robot" or "opposite".
    """

    name: str
    noun: str
    display_name: str
    color: str
    position: tuple[float, float, float]
    sides: tuple[float, float, float]
    place: str
    outline: BaseGeometry
    on: str = ""
    confidence: float | None = None
    viewpoint: str = "robot"

    @property
    def label(self) -> str:
        """Return its name, and what the picture takes it for: "object 2 (mug, 0.93)"."""
        return self.name if self.confidence is None else f"{self.name} ({self.noun}, {self.confidence:.2f})"

    @property
    def where(self) -> str:
        """Return its place in words and centimetres."""
        on = f"on {with_article(self.on)}, " if self.on else ""
        return f"{on}{self.place}: {place(self.position, self.viewpoint)}"

    @property
    def described(self) -> str:
        """Return its name with all the words that describe it: "cup 2, red, tall", "object 2 (mug, 0.93), red"."""
        return ", ".join((self.label, *self.display_name.split(", ")[1:]))


def with_article(name: str) -> str:
    """Return the name as used in a sentence: "the banana", but "cup 2"."""
    return name if re.search(r"\d$", name) else f"the {name}"


def object_facts(seen: events.Perceived, viewpoint: str = "robot") -> list[Fact]:
    """Return the facts of each object that was seen.

    Args:
        seen: the observation with its clouds.
        viewpoint: whose left and right is meant, "robot" or "opposite".
    """
    clouds = (*seen.scene.objects, *seen.scene.distractors)
    sides = [_sides(cloud) for cloud in clouds]
    shapes = shape_words([np.array(side) for side in sides])
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    standing_on = _supports(clouds, outlines)
    facts = []
    for index, (one, cloud) in enumerate(zip(seen.objects, clouds, strict=True)):
        known = {"name": one.name, "display_name": one.display_name, "color_name": one.color_name}
        display_name = one.display_name if one.confidence is not None else describe_object(known)
        color = next((word for word in _words(display_name) if word in COLORS), "") or _color(cloud, seen.scene)
        words = [word for word in (color, *shapes[index]) if word and word not in _words(display_name)]
        facts.append(
            Fact(
                one.name,
                one.category,
                ", ".join((display_name, *words)),
                color,
                one.position,
                sides[index],
                place_in_words(one.position, seen.table, viewpoint),
                outlines[index],
                standing_on[index],
                one.confidence,
                viewpoint,
            )  # fmt: skip
        )
    return facts


def matching_facts(about: str, facts: Sequence[Fact], encoder: SentenceEncoder | None = None) -> list[Fact]:
    """Return all objects that a noun phrase describes; empty if there is none.

    Args:
        about: "banana", "red cup", "cup 2", "things".
        facts: the facts of all objects.
        encoder: sentence encoder for unknown nouns.
    """
    words = about.split()
    if not words or _ANY.issuperset(words):
        return list(facts)
    exactly = [fact for fact in facts if fact.name.lower() == about]
    if exactly:
        return exactly
    if not ORDINALS.keys().isdisjoint(words):
        pass  # "the second cup" is one
    elif words[-1] in _ANY:
        words[-1] = "objects"
    elif not words[-1].isdecimal():
        words[-1] = plural(singular(words[-1]))
    try:
        found = resolve_phrase(f"the {' '.join(words)}", Referents([fact.display_name for fact in facts], encoder))
    except ResolveError:
        return []
    # Without a known noun or a word that distinguishes objects, the phrase would match every object.
    telling = found.nouns or len(found.indices) < len(facts) or not unknown_adjectives(about, facts)
    return [facts[index] for index in found.indices] if telling else []


def unknown_adjectives(about: str, facts: Sequence[Fact]) -> list[str]:
    """Return the adjectives about which nothing is known, such as "wooden"."""
    known = {adjective(word) for fact in facts for word in _words(fact.display_name)}
    words = [word for word in about.split()[:-1] if not word.isdecimal() and word not in ORDINALS]
    return [word for word in words if known.isdisjoint((adjective(word), *rivals(adjective(word))))]


def place_in_words(position: Sequence[float], table: Sequence[float], viewpoint: str = "robot") -> str:
    """Describe the place of a point from the speaker's viewpoint, as in "on the left, near you".

    Args:
        position: (x, y, ...) world frame, metres.
        table: (x_min, x_max, y_min, y_max).
        viewpoint: whose left and right is meant.
    """
    x_min, x_max, y_min, y_max = table
    ahead, aside = (position[0] - x_min) / (x_max - x_min), (y_max - position[1]) / (y_max - y_min)
    if viewpoint == "opposite":
        ahead, aside = 1 - ahead, 1 - aside
    across, deep = (words[int(np.clip(3 * share, 0, 2))] for words, share in zip(_THIRDS, (aside, ahead), strict=True))
    if (across, deep) == ("center", "halfway back"):
        return "in the middle of the table"
    return f"{'in' if across == 'center' else 'on'} the {across}, {deep}"


def count_by_noun(facts: Sequence[Fact]) -> str:
    """Count objects by noun, as in "3 cups, 2 boxes and an orange"."""
    nouns = [fact.noun for fact in facts]
    return join_words([_counted(noun, nouns.count(noun)) for noun in dict.fromkeys(nouns)]) or "nothing"


def _counted(noun: str, count: int) -> str:
    if count > 1:
        return f"{count} {plural(noun)}"
    return with_indefinite_article(noun)


def join_words(words: Sequence[str]) -> str:
    """Join words, as in "cup 1, cup 2 and cup 3"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def capitalized(text: str) -> str:
    """Return the sentence with its first letter in upper case and all others unchanged."""
    return text[:1].upper() + text[1:]


def _words(display_name: str) -> list[str]:
    return re.findall(r"[a-z]+", display_name.lower())


def _color(cloud: ObjectCloud, scene: Scene) -> str:
    if cloud.colors is None or scene.color is None:
        return ""
    return color_word_in_picture(cloud.colors, scene.color)


def _sides(cloud: ObjectCloud) -> tuple[float, float, float]:
    long, short, top = oriented_box(cloud.points)[1].tolist()
    return long, short, top - cloud.bottom


def _supports(clouds: Sequence[ObjectCloud], outlines: Sequence[BaseGeometry]) -> list[str]:
    """Return the name of what each object stands on; empty for the table."""
    bottoms = [cloud.bottom for cloud in clouds]
    names = []
    for upper in range(len(clouds)):
        below = [lower for lower in range(len(clouds)) if stands_above(upper, lower, outlines, bottoms)]
        names.append(clouds[max(below, key=lambda lower: bottoms[lower])].name if below else "")
    return names
