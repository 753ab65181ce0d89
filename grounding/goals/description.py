"""Describe the parts of a goal in words."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.figures.drawings import without_drawings
from grounding.goals.parts import Objects, Part, PartReference, RelationPart


def describe_parts(parts: Sequence[Part], names: Sequence[str] | None = None) -> str:
    """Describe all parts of a goal in one line; see `describe_part`."""
    return "; ".join(describe_part(part, names) for part in parts)


def describe_part(part: Part, names: Sequence[str] | None = None) -> str:
    """Describe a part in a phrase: "line of mug, mug 2, left, gap 5 cm".

    Args:
        part: the part.
        names: of the scene's objects, by index.
    """

    def said(objects: Objects | None) -> str:
        if objects is None:
            return "everything else"
        if isinstance(objects, PartReference):
            return f"part {objects.part + 1}"
        return ", ".join(names[i] if names is not None and isinstance(i, int) else str(i) for i in objects)

    if isinstance(part, RelationPart):
        words = [said(part.objects), part.relation, said(part.reference) if part.reference is not None else ""]
        words += [part.y_position or "", part.x_position or "", part.direction or ""]
        words += [f"by {part.distance * 100:.4g} cm"] if part.distance is not None else []
        return " ".join(filter(None, words))
    values = [f"{without_drawings(part.shape or 'structure')} of {said(part.objects)}"]
    values += [
        f"facing {value}" if slot == "rotation" else value for slot, value in part.spec.tokens() if slot != "shape"
    ]
    for key, value in part.keys.items():
        if key == "order":
            order = " ".join(
                filter(None, ("order by", value.by, value.direction, value.start and f"from {value.start}"))
            )
            values.append(order)
        elif key == "around":
            values.append(f"around {said(value)}")
        elif isinstance(value, float):
            values.append(f"{key} {value * 100:.4g} cm")
        else:
            values.append(f"{key.replace('_', ' ')} {value}")
    return ", ".join(values)
