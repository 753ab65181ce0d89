"""Describe what stands still around the objects in pictures: the table with its legs, and an arm's pedestal."""

from __future__ import annotations

from collections.abc import Sequence

from agent.rendering.surfaces import Surface, box
from structdiffusion.observation import Table
from structdiffusion.simulation.bodies import TABLE_THICKNESS

FLOOR = -0.42  # z: low enough for the height of a table, high enough to be visible in pictures
TOP_FACES = 12  # of the table top, the first of the furniture
_WOOD, _METAL = (0.80, 0.66, 0.50), (0.60, 0.62, 0.66)
_LEG, _INSET, _PEDESTAL = 0.045, 0.01, 0.11  # m: width of a leg, its distance to the edge, half a pedestal


def furniture(ground: Table, base: Sequence[float] | None) -> list[Surface]:
    """Return the table top, its legs, and the pedestal of an arm beside it."""
    low, high = (ground.x_min, ground.y_min, -TABLE_THICKNESS), (ground.x_max, ground.y_max, 0.0)
    parts = [Surface(*box(low, high), _WOOD)]
    for x in (ground.x_min + _INSET, ground.x_max - _INSET - _LEG):
        parts += [
            Surface(*box((x, y, FLOOR), (x + _LEG, y + _LEG, -TABLE_THICKNESS)), _WOOD)
            for y in (ground.y_min + _INSET, ground.y_max - _INSET - _LEG)
        ]
    on_table = base is not None and ground.x_min <= base[0] <= ground.x_max and ground.y_min <= base[1] <= ground.y_max
    if base is not None and not on_table:
        x, y, z = base
        parts.append(Surface(*box((x - _PEDESTAL, y - _PEDESTAL, FLOOR), (x + _PEDESTAL, y + _PEDESTAL, z)), _METAL))
    return parts
