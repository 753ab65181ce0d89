"""Sentences and slots: what an instruction asks for, and which objects it means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from agent.errors import NOT_BUILDABLE
from grounding.references.attributes import SceneObject
from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec
from structagent.arguments import check_choice, check_text, is_listing, shown, wrong_argument
from structagent.clouds import checked_names
from structagent.engine import computing
from structagent.errors import StructagentError, public_errors
from structagent.scenes import Scene

if TYPE_CHECKING:
    from agent.pipeline.resources import Loaded
    from grounding.interpreter import Reading

PARSERS = ("embedding", "llm")
VIEWPOINTS = ("robot", "opposite")


@dataclass(frozen=True)
class ParsedInstruction:
    """What an instruction asks for.

    Attributes:
        text: the instruction.
        spec: the five slots in the world frame; a slot that was left open is `None`.
        status: "ok", "ask" (the speaker has to say more) or "refused".
        message: the question, why it is refused, or what else has to be said; may be empty.
        options: with "ask", the answers that may be meant, the likeliest first.
        objects: the names of the objects that are meant, or the text's words for them without a scene; `None` for all.
        dropped: slot -> value that was understood but cannot go with the rest, such as a tower's size.
        confidence: slot -> how sure the parser is, in [0, 1].
    """

    text: str
    spec: StructureSpec
    status: str
    message: str = ""
    options: tuple[str, ...] = ()
    objects: tuple[str, ...] | None = None
    dropped: Mapping[str, str] = field(default_factory=dict)
    confidence: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Wish:
    """What is to be built with which objects of a scene.

    Attributes:
        spec: the slots, world frame.
        members: indices of the objects that take part, ascending.
        notes: what has to be said about the reading, a sentence each.
    """

    spec: StructureSpec
    members: tuple[int, ...]
    notes: tuple[str, ...] = ()


@public_errors()
def parse(
    text: str,
    objects: Sequence[str] | Scene | None = None,
    *,
    viewpoint: str = "robot",
    parser: str = "embedding",
) -> ParsedInstruction:
    """Read an instruction into the five slots.

    Args:
        text: the instruction, in English.
        objects: the names of the objects on the table, or a `Scene`; `None` where nothing is known of them.
        viewpoint: whose left and right is meant: "robot", or "opposite" for a person across the table.
        parser: "embedding", or "llm" for the local language model.

    Returns:
        The slots. A question or a refusal is no error here: see `status`.

    Raises:
        StructagentError: for a text or names that are no strings, and an unknown viewpoint or parser.
    """
    referents = objects.referents if isinstance(objects, Scene) else _named_objects(objects)
    with computing() as loaded:
        reading = _reading(loaded, text, viewpoint, parser, referents)
    display = dict(zip(objects.referents, objects.names, strict=True)) if isinstance(objects, Scene) else {}

    def name(each: SceneObject | str) -> str:
        return display.get(each, each.name) if isinstance(each, SceneObject) else each

    return ParsedInstruction(
        text,
        reading.spec,
        reading.status,
        "; ".join(filter(None, (reading.message, reading.fallback))),
        tuple(map(name, reading.question.options)) if reading.question else (),
        None if reading.objects is None else tuple(map(name, reading.objects)),
        dict(reading.parse.dropped),
        dict(reading.parse.confidence),
    )


def _named_objects(objects: Any) -> tuple[SceneObject, ...] | None:
    if objects is None:
        return None
    legal = "a list of names, such as ['mug', 'bowl'], or None where nothing is known of the objects"
    if not is_listing(objects) or len(objects) == 0:
        raise wrong_argument(f"objects cannot be {shown(objects)}; legal: {legal}")
    return tuple(map(SceneObject, checked_names(objects, len(objects), "objects")[0]))


def _reading(
    loaded: Loaded, text: Any, viewpoint: Any, parser: Any = PARSERS[0], referents: Sequence[SceneObject] | None = None
) -> Reading:
    from agent.pipeline.instruction_parser import ReadingOptions

    check_text(text)
    check_choice("viewpoint", viewpoint, VIEWPOINTS)
    check_choice("parser", parser, PARSERS)
    return loaded.reader(ReadingOptions(parser, viewpoint)).read(text, referents)


def _built(reading: Reading) -> Reading:
    if reading.status != "ok":
        raise StructagentError(reading.message, NOT_BUILDABLE)
    return reading


def spec_of_text(loaded: Loaded, text: str, viewpoint: str) -> StructureSpec:
    """The slots of a sentence, whatever objects there are, world frame.

    Raises:
        StructagentError: where it is refused, or has to ask.
    """
    return _built(_reading(loaded, text, viewpoint)).spec


def wish_of_text(loaded: Loaded, text: str, scene: Scene, viewpoint: str, parser: str) -> Wish:
    """What a sentence asks for in a scene.

    Raises:
        StructagentError: where it is refused, where it has to ask, and where objects that it names are not there.
    """
    reading = _built(_reading(loaded, text, viewpoint, parser, scene.referents))
    meant = set(reading.objects or scene.referents)
    members = tuple(index for index, each in enumerate(scene.referents) if each in meant)
    dropped = [
        f"the {slot.replace('_', ' ')} {value!r} was left out: a {reading.spec.shape or 'structure'} has none"
        for slot, value in reading.parse.dropped.items()
    ]
    return Wish(reading.spec, members, tuple(filter(None, (reading.message, reading.fallback, *dropped))))


def checked_spec(slots: Any) -> StructureSpec:
    """The slots of a `StructureSpec` or a mapping; a slot that is missing or `None` is left open.

    Raises:
        StructagentError: for an unknown slot, and where no slot says anything.
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
            f"no slot says anything; name at least one of {', '.join(SLOTS)}, such as {{'shape': 'circle'}}"
        )
    return spec


def checked_members(objects: Any, names: Sequence[str]) -> tuple[int, ...]:
    """Indices of the objects that take part, ascending; `None` means all.

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
