"""Goals that no parser has to read: some of the objects in a line."""

from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpretation import Interpretation
from grounding.parse_result import Parse
from grounding.resolve.goal import ResolvedPhrase
from grounding.spec import StructureSpec


def a_line(source, indices=None) -> Interpretation:
    """A line of these of the source's objects; of all of them by default."""
    spec, chosen = StructureSpec("line"), range(len(source.referents)) if indices is None else indices
    parse = Parse("line them up", spec, "by hand")
    goal = Goal((StructurePart.of(spec, tuple(chosen)),))
    return Interpretation(parse, spec, "ok", "", "robot", None, 0.0, selection=ResolvedPhrase(tuple(chosen)), goal=goal)
