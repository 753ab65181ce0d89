"""The structures that can be built, one module each.

`Structure` (in `structure.py`) is the protocol that every structure implements, and no other module branches on a
shape's name. To add a structure:

1. its name and slots in `grounding.spec` (`SHAPES`, `SLOTS_OF_SHAPE`) and the words for it in `grounding`;
2. a module here with its class, and the class in `STRUCTURES` below;
3. the numbers of its checks in `structdiffusion.evaluation_protocol`, and a test.

What the class must have: `name`, `least`, `usual_counts`, `draft` (an exact layout) and `check` (the conditions of the
evaluation protocol). What it may have, beside defaults that hold for a flat structure of any objects: which objects
suit it (`suits`, `choose`, `nouns`, `requirement`), which object takes which place (`order_places`), its `centre`,
whether it faces anywhere (`has_heading`, `rotations`), and how sampled poses are corrected (`corrections`, `turns`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from grounding.figures.figure import Figure, FigureError
from grounding.figures.names import figure_named
from grounding.spec import FIRST_SHAPES
from structdiffusion.structures.arc import Arc
from structdiffusion.structures.circle import Circle
from structdiffusion.structures.cluster import Cluster
from structdiffusion.structures.cross import Cross
from structdiffusion.structures.exact_copy import ExactCopy
from structdiffusion.structures.flat_figure import FlatFigure
from structdiffusion.structures.grid import Grid
from structdiffusion.structures.line import Line
from structdiffusion.structures.pyramid import Pyramid
from structdiffusion.structures.rectangle import Rectangle, Square
from structdiffusion.structures.structure import LayoutError, Structure
from structdiffusion.structures.table_setting import TableSetting
from structdiffusion.structures.tower import Tower
from structdiffusion.structures.triangle import Triangle
from structdiffusion.structures.upright_figure import UprightFigure

# In the order of `grounding.spec.SHAPES`.
STRUCTURES: Mapping[str, Structure] = {
    structure.name: structure
    for structure in (
        Circle(), Line(), Tower(), TableSetting(),
        Cluster(), Rectangle(), Square(), Triangle(), Arc(), Grid(), Cross(), Pyramid(),
    )
}  # fmt: skip
# What an open shape may become: the shapes that every planner knows.
OPEN_SHAPES: Mapping[str, Structure] = {name: STRUCTURES[name] for name in FIRST_SHAPES}


def structure_named(shape: str) -> Structure:
    """Return the structure of a shape, or of a figure.

    Raises:
        LayoutError: for a name that has neither.
    """
    if shape in STRUCTURES:
        return STRUCTURES[shape]
    try:
        return _of_figure(figure_named(shape))
    except FigureError as error:
        raise LayoutError(str(error)) from error


@lru_cache(maxsize=256)
def _of_figure(figure: Figure) -> Structure:
    if figure.places:
        return ExactCopy(figure)
    return UprightFigure(figure) if figure.blocks else FlatFigure(figure)
