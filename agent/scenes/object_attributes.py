"""Determine the attributes of objects that instructions can refer to: colour and size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from agent.perception.color_names import color_terms
from grounding.resolve.attributes import COLOR_WORDS, ObjectAttributes
from structdiffusion.objects.model import ObjectModel


def attributes_of(model: ObjectModel) -> ObjectAttributes:
    """Name the colour of an object model, and measure its box as it rests."""
    return ObjectAttributes(color_words(color_terms(model.color)), _size(model.footprint, model.height))


def attributes_at(attributes: ObjectAttributes, world_from_object: np.ndarray) -> ObjectAttributes:
    """Return the attributes of an object that stands at a pose (4, 4)."""
    x, y = world_from_object[:2, 3].tolist()
    return replace(attributes, position=(x, y))


def color_words(terms: tuple[str, ...]) -> tuple[str, ...]:
    """Spell names of colours as `grounding.resolve.attributes.COLOR_WORDS` does: "grey" for "gray"."""
    return tuple(dict.fromkeys(COLOR_WORDS[term][0] for term in terms))


def _size(footprint: np.ndarray, height: float) -> tuple[float, float, float]:
    """Return (length, width, height) in metres of the upright box around an outline (K, 2)."""
    corners = np.array(shapely.Polygon(footprint).minimum_rotated_rectangle.exterior.coords)
    sides = sorted(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).tolist())
    return sides[1], sides[0], height
