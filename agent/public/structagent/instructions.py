"""Interpret sentences and slots: what an instruction asks for, and which objects it means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from agent.errors import NOT_BUILDABLE
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.resolve.attributes import SceneObject
from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec
from structagent.arguments import check_choice, check_text, is_listing, shown, wrong_argument
from structagent.clouds import checked_names
from structagent.engine import computing, reading
from structagent.errors import StructagentError, in_python, public_errors
from structagent.scenes import Scene

if TYPE_CHECKING:
    from agent.pipeline.resources import ResourceCache
    from agent.scenes.sources import SceneSource
    from grounding.interpretation import Interpretation

PARSERS = ("embedding", "llm")
VIEWPOINTS = ("robot", "opposite")


@dataclass(frozen=True, repr=False)
class ParsedInstruction:
    """What an instruction asks for.

    Attributes:
        text: the instruction.
        spec: the five slots in the world frame; a slot that was left open is `None`.
        goal: all parts, in the world frame: structures with their slots and keys, and relations. Objects are indices
            into those that were given, or the text's words without a scene. Empty if it is refused or needs a question.
        status: "ok", "ask" (the speaker has to say more) or "refused".
        message: the question, the reason of a refusal, or a remark; may be empty.
        options: with "ask", the possible answers, the most likely first; they may be whole goals in words.
        objects: the names of the selected objects, or the text's words for them without a scene; `None` for all.
        dropped: slot -> value that was understood but cannot go with the rest, such as a tower's size.
        confidence: slot -> how sure the parser is, in [0, 1].
        suggestions: goals that the text may mean, the likeliest first; never built unless asked for. With "ask", those
            behind the options.
    """

    text: str
    spec: StructureSpec
    status: str
    message: str = ""
    options: tuple[str, ...] = ()
    objects: tuple[str, ...] | None = None
    dropped: Mapping[str, str] = field(default_factory=dict)
    confidence: Mapping[str, float] = field(default_factory=dict)
    goal: Goal = Goal()
    suggestions: tuple[Goal, ...] = ()

    def __repr__(self) -> str:
        found = "; ".join(filter(None, (self.message, ", ".join(self.options) or describe_parts(self.goal.parts))))
        return f"ParsedInstruction({self.text!r}: {self.status}; {found})"


@dataclass(frozen=True)
class SceneGoal:
    """The goal of an instruction in a scene.

    Attributes:
        spec: the slots of one structure, world frame.
        members: indices of the objects that take part, ascending.
        notes: remarks on the interpretation, a sentence each.
        goal: all parts, world frame; objects are indices, and every structure lists its objects.
    """

    spec: StructureSpec
    members: tuple[int, ...]
    notes: tuple[str, ...]
    goal: Goal


@public_errors()
def parse(
    text: str,
    objects: Sequence[str] | Scene | None = None,
    *,
    viewpoint: str = "robot",
    parser: str = "embedding",
) -> ParsedInstruction:
    """Parse an instruction into a goal and, if it asks for one structure, into the five slots.

    Args:
        text: the instruction, in English.
        objects: the names of the objects on the table, or a `Scene`; `None` if they are unknown.
        viewpoint: whose left and right is meant: "robot", or "opposite" for a person across the table.
        parser: "embedding", or "llm" for the local language model.

    Returns:
        The goal. A question or a refusal is no error here: see `status`.

    Raises:
        StructagentError: for a text or names that are no strings, and an unknown viewpoint or parser.
    """
    referents = objects.referents if isinstance(objects, Scene) else _named_objects(objects)
    with computing() if parser == "llm" else reading() as cache:
        goal = _interpreted(cache, text, viewpoint, parser, referents)
    names = [each.name for each in referents or ()]
    display = dict(zip(names, objects.names, strict=True)) if isinstance(objects, Scene) else {}
    return ParsedInstruction(
        text,
        goal.spec,
        goal.status,
        "; ".join(filter(None, (goal.message, goal.fallback))),
        tuple(display.get(option, option) for option in goal.question.options) if goal.question else (),
        None if goal.objects is None else tuple(display.get(name, name) for name in goal.objects),
        dict(goal.parse.dropped),
        dict(goal.parse.confidence),
        goal.goal,
        goal.suggestions,
    )


def _named_objects(objects: Any) -> tuple[SceneObject, ...] | None:
    if objects is None:
        return None
    legal = "a list of names, such as ['mug', 'bowl'], or None where nothing is known of the objects"
    if not is_listing(objects) or len(objects) == 0:
        raise wrong_argument(f"objects cannot be {shown(objects)}; legal: {legal}")
    return tuple(map(SceneObject, checked_names(objects, len(objects), "objects")[0]))


def _interpreted(
    cache: ResourceCache, text: Any, viewpoint: Any, parser: Any, referents: Sequence[SceneObject] | None = None
) -> Interpretation:
    from agent.pipeline.instruction_parser import ReadingOptions

    check_text(text)
    check_choice("viewpoint", viewpoint, VIEWPOINTS)
    check_choice("parser", parser, PARSERS)
    return cache.interpreter(ReadingOptions(parser, viewpoint)).interpret(text, referents)


def _buildable(goal: Interpretation, referents: Sequence[SceneObject] | None, hint: str = "") -> Interpretation:
    """Return an interpretation that says what to build; raise `StructagentError` for any other."""
    if goal.status != "ok":
        from agent.pipeline.event_builders import why_not

        names = None if referents is None else [each.name for each in referents]
        raise StructagentError(in_python(why_not(goal, names, hint)), NOT_BUILDABLE)
    return goal


def goal_of_text(cache: ResourceCache, text: Any, viewpoint: Any, source: SceneSource) -> Interpretation:
    """Interpret a sentence about the objects of a source, or about those that it can draw.

    Raises:
        StructagentError: if it is refused, or has to ask.
    """
    if not source.catalogue:
        read = _interpreted(cache, text, viewpoint, PARSERS[0], source.referents)
        return _buildable(read, source.referents, source.hint)
    read = _buildable(_interpreted(cache, text, viewpoint, PARSERS[0]), None)
    return _buildable(read.among(source.referents, True), source.referents, source.hint)


def scene_goal_of_text(cache: ResourceCache, text: str, scene: Scene, viewpoint: str, parser: str) -> SceneGoal:
    """Interpret a sentence about the objects of a scene.

    Raises:
        StructagentError: if it is refused, needs a question, or names objects that are not there.
    """
    goal = _buildable(_interpreted(cache, text, viewpoint, parser, scene.referents), scene.referents)
    notes = (goal.message, goal.fallback, *dropped_notes(goal.spec, goal.parse.dropped))
    notes = tuple(filter(None, notes))
    if goal.goal.plain_spec is None:
        return scene_goal_of_parts(goal.goal, len(scene), notes)
    assert goal.selection is not None  # the objects are known
    members = tuple(sorted(goal.selection.indices))
    return SceneGoal(goal.spec, members, notes, Goal((StructurePart.of(goal.spec, members),)))


def scene_goal_of_parts(goal: Goal, count: int, notes: tuple[str, ...] = ()) -> SceneGoal:
    """Return a goal in a scene of `count` objects, with the objects of every structure listed."""
    goal = goal.resolved(count)
    objects = {index for part in goal.parts if isinstance(part.objects, tuple) for index in part.objects}
    members = tuple(sorted(index for index in objects if isinstance(index, int)))
    return SceneGoal(goal.plain_spec or StructureSpec(), members, notes, goal)


def dropped_notes(spec: StructureSpec, dropped: Mapping[str, str]) -> list[str]:
    """Write a sentence for each slot that was understood and that the shape cannot have."""
    shape = spec.shape or "structure"
    return [
        f"the {slot.replace('_', ' ')} {value!r} was left out: a {shape} has none" for slot, value in dropped.items()
    ]


def checked_spec(slots: Any) -> StructureSpec:
    """Check and return the slots of a `StructureSpec` or a mapping; a slot that is missing or `None` is left open.

    Raises:
        StructagentError: for an unknown slot, and if no slot has a value.
        SpecError: for a value that is not legal.
    """
    if not isinstance(slots, StructureSpec | Mapping):
        raise wrong_argument(
            f"the instruction cannot be {shown(slots)}; legal: a sentence, a StructureSpec, or a dict with the slots "
            f"{', '.join(SLOTS)}"
        )
    if isinstance(slots, Mapping):
        for slot, value in slots.items():
            if slot not in SLOTS:
                raise wrong_argument(f"there is no slot {shown(slot)}; legal: {', '.join(SLOTS)}")
            if value is not None and not isinstance(value, str):
                raise wrong_argument(
                    f"{slot} cannot be {shown(value)}; legal values: {', '.join(LEGAL_VALUES[slot])}, or None"
                )
    spec = slots if isinstance(slots, StructureSpec) else StructureSpec.from_dict(slots)
    if not spec.tokens():
        raise wrong_argument(
            f"no slot has a value; name at least one of {', '.join(SLOTS)}, such as {{'shape': 'circle'}}"
        )
    return spec


def checked_goal(values: Mapping[str, Any] | Goal, names: Sequence[str]) -> Goal:
    """Check and return a goal over the objects of these names; names in it become indices.

    Raises:
        StructagentError: for an object that is not there, and a goal without parts.
        GoalError: for anything that is not a legal goal.
    """
    goal = Goal.from_dict(values if isinstance(values, Mapping) else values.to_dict())
    legal = f"indices of 0 to {len(names) - 1}, or names: {', '.join(names)}"
    if not goal.parts:
        raise wrong_argument("the goal has no parts; legal: 1 or more")
    place = {entry: _member(entry, "an object of the goal", names, legal) for entry in goal.named_objects()}

    def placed(objects: Any) -> Any:
        return [place[entry] for entry in objects] if isinstance(objects, list) else objects

    keys = ("objects", "reference", "around")
    parts = [part | {key: placed(part[key]) for key in keys if key in part} for part in goal.to_dict()["parts"]]
    return Goal.from_dict({"parts": parts})


def checked_members(objects: Any, names: Sequence[str]) -> tuple[int, ...]:
    """Check and return the indices of the objects that take part, ascending; `None` means all.

    Args:
        objects: indices or names.
        names: of all objects.

    Raises:
        StructagentError: for an unknown name or index, one that is given twice, and an empty list.
    """
    if objects is None:
        return tuple(range(len(names)))
    legal = f"indices of 0 to {len(names) - 1}, or names: {', '.join(names)}"
    if not is_listing(objects) or len(objects) == 0:
        raise wrong_argument(f"objects cannot be {shown(objects)}; legal: a list of {legal}")
    members = [_member(entry, f"objects[{place}]", names, legal) for place, entry in enumerate(objects)]
    for place, index in enumerate(members):
        if index in members[:place]:
            raise wrong_argument(f"objects names {names[index]!r} twice; legal: each once, {legal}")
    return tuple(sorted(members))


def _member(entry: Any, place: str, names: Sequence[str], legal: str) -> int:
    if isinstance(entry, str):
        if entry in names:
            return names.index(entry)
    elif hasattr(entry, "__index__") and not isinstance(entry, bool) and 0 <= entry.__index__() < len(names):
        return entry.__index__()
    raise wrong_argument(f"{place} cannot be {shown(entry)}; legal: {legal}")
