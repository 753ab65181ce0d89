"""Decide which reading of an instruction counts: the goal network's, or that of the grammar and the parser of five slots.

The grammar's reader builds nothing that has a word it does not know, which is safe and refuses much of what people say.
The network reads such sentences too, and says how certain it is. Its goal is used in place of a refusal, a question or
another goal only where it is certain, legal, feasible and free of contradictions; words that the grammar does not know
are then quoted in a note.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from grounding.goal_network.network_reading import NetworkReading, brings_together
from grounding.goal_network.vocabulary import NOTHING
from grounding.goal_network.weighty_words import WEIGHTY, WEIGHTY_IF_UNKNOWN, weighty, words_held
from grounding.goal_reading.reader import GoalReading, more_than_plain
from grounding.goal_reading.unread_words import unread_note
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.spec import SLOTS, StructureSpec

# Chosen on labelled instructions that neither the network nor the grammar's authors had seen (docs/parsing.md).
CERTAIN = 0.7  # in place of a refusal or a question, or of a larger goal where the parser of the five slots agrees
IMPOSSIBLE = 0.75  # in place of a refusal of what was understood and cannot be built
ANOTHER_GOAL = 0.8  # in place of another goal
# Where parts contradict each other, a place must be asked for, or nothing seems to be asked for; and that nothing is.
CONTRARY = 0.9
SURE = 0.95  # against a rule that forbids to build
AGREED_PLAIN = 0.9  # in place of one plain structure that the grammar and the parser of the five slots agree on
AGREED = 0.5  # in place of a refusal or a question, where the parser of five slots reads the same and no scene is known
HALF_READ = 0.5  # in place of a plain structure of whose instruction the grammar knows only a part: it is mostly wrong
# Exceptions that do not follow their noun at once are what the network loses most: another goal that was read stays.
_EXCEPTION = re.compile(
    r"\b(?:except\w*|but|minus|without|not|don't|other than|save|apart|aside|besides|excluding|leav\w+|bar)\b",
    re.IGNORECASE,
)
_KEPT = re.compile(
    r"\b(?:stay\w*|keep\w*|kept|leav\w+|remain\w*|untouched|alone|where (?:it|they) (?:is|are)|exempt\w*|excus\w+|mind|bother\w*"
    r"|not (?:required|needed|wanted)|ignor\w+|forget|skip\w*)\b",
    re.IGNORECASE,
)
_PARALLEL = frozenset("parallel perpendicular".split())  # of a line to an edge; no goal holds how an object lies
# What was named before, as the network sees it less well than the grammar: "the bowl behind that".
_POINTS_BACK = re.compile(r"\b(?:behind|in front of|of|next to|beside|on|in) that\b", re.IGNORECASE)
# Objects that stand in a row already, "the blocks in the front row": the other readers take its side for a place.
_STANDING_ROW = re.compile(r"\b(?:front|back|rear|near(?:est)?|far|middle|left|right)(?:-hand)? (?:row|column)\b", re.IGNORECASE)
# An order that an instruction asks for.
_ORDERED = re.compile(
    r"\b(?:in (?:order|sequence) of|in (?:\w+ )?order|ordered|sort(?:ed)?|by (?:size|height|width|volume|weight))\b", re.IGNORECASE
)


@dataclass(frozen=True)
class FirstReading:
    """What the grammar and the parser of the five slots made of an instruction.

    Attributes:
        reading: the grammar's.
        status: what it came to: "ok", "ask" or "refused".
        goal: in the speaker's frame; without parts unless the status is "ok".
        requests: whether the instruction is worded as a request, and not like a question about the scene.
        idle: whether the parser of the five slots sees no arranging in it.
        text: the instruction.
        excepts: whether it may leave something out.
        keeps: whether it may say what stays as it is.
        asks_place: whether it asks for a place, as for the corner that is meant: the network leaves such places out.
        sorts: whether it asks for an order.
        slots: what the parser of the five slots reads, in the speaker's frame; `None` where it refuses or asks.
        agreed: whether grammar and parser agree on one plain structure.
    """

    reading: GoalReading
    status: str
    goal: Goal
    requests: bool
    idle: bool
    text: str = ""
    excepts: bool = False
    keeps: bool = False
    asks_place: bool = False
    sorts: bool = False
    slots: StructureSpec | None = None
    agreed: bool = False

    @property
    def plain(self) -> bool:
        """Return whether it is one plain structure, which the parser of the five slots reads best."""
        return self.status == "ok" and not more_than_plain(self.goal)

    @property
    def half_read(self) -> bool:
        """Return whether it is a plain structure of whose instruction the grammar knows only a part."""
        return self.plain and not self.reading.complete


def counts(second: NetworkReading, first: FirstReading, count: int | None) -> bool:
    """Decide whether the network's goal is used in place of the first reading.

    Args:
        second: the network's reading.
        first: the other one.
        count: of objects in the scene; `None` if none is known.
    """
    if second.goal is None or not second.goal.parts:  # "leave the mugs alone" has no part
        return False
    reading = first.reading
    if reading.work or reading.never or reading.definite or brings_together(second) or _leaves_place_open(second, first):
        return False
    if second.certainty < SURE and (_forbidden(second, first) or _lacks_objects(second, first)):
        return False
    if first.status == "ok":
        return _replaces(second, first, count)
    return _stands_in(second, first, count)


def _leaves_place_open(second: NetworkReading, first: FirstReading) -> bool:
    """Return whether it must be asked which place is meant, and the network's goal may have none."""
    assert second.goal is not None
    return first.asks_place and not (second.certainty >= CONTRARY and _has_place(second.goal))


def _forbidden(second: NetworkReading, first: FirstReading) -> bool:
    """Return whether a rule knows a reason why a goal is not to be built, or not as the network has it."""
    reading, goal = first.reading, second.goal
    assert goal is not None
    if reading.conditions or weighty(second.uncopied):
        return True
    if not first.requests and (second.certainty < CONTRARY or first.text.rstrip().endswith("?")):
        return True
    if _PARALLEL & set(second.uncopied) and not any(part.along for part in goal.structures):
        return True
    if reading.paired and any(isinstance(part, RelationPart) for part in goal.parts):
        return True  # each has its own
    unknown = {word for words in reading.residue for word in re.findall(r"[a-z]+", words.lower())}
    unknown &= WEIGHTY | WEIGHTY_IF_UNKNOWN
    return (first.sorts and not _sorted(goal)) or (first.status != "ok" and bool(unknown - words_held(goal, first.text)))


def _replaces(second: NetworkReading, first: FirstReading, count: int | None) -> bool:
    """Return whether the network's goal is used in place of another goal."""
    reading, goal = first.reading, second.goal
    assert goal is not None
    if first.agreed:
        enough = CERTAIN if _STANDING_ROW.search(first.text) else AGREED_PLAIN
        return count is not None and second.certainty >= enough and _differ(goal, first.goal, count)
    if agrees(goal, first.slots) and not first.plain:
        return second.certainty >= CERTAIN
    if first.plain and (count is None or supports(goal, first.goal, second.certainty >= SURE)):
        return False
    if not first.plain and second.certainty < SURE and reading.complete and not reading.corrected and _loses(goal, first.goal):
        return False
    if reading.complete and _POINTS_BACK.search(first.text) and _other_references(goal, first.goal):
        return False
    enough = second.certainty >= (HALF_READ if first.half_read else ANOTHER_GOAL)
    enough = enough and (first.half_read or not first.excepts)
    return enough and _differ(goal, first.goal, count)


def _stands_in(second: NetworkReading, first: FirstReading, count: int | None) -> bool:
    """Return whether the network's goal is used in place of a refusal or a question."""
    assert second.goal is not None
    if first.slots is not None and not more_than_plain(second.goal) and _contradicts(second.goal, first.slots):
        return False
    agreed = agrees(second.goal, first.slots)
    if agreed and count is None and not first.idle:
        return second.certainty >= AGREED
    if first.idle or first.reading.contradictory:
        return second.certainty >= CONTRARY
    return second.certainty >= (IMPOSSIBLE if first.reading.impossible and not agreed else CERTAIN)


def _has_place(goal: Goal) -> bool:
    """Return whether each part of a goal has a place on the table, or is beside something."""
    return all(
        isinstance(part, RelationPart) or part.along is not None or part.x_position is not None or part.y_position is not None
        for part in goal.parts
    )


def asks_nothing(second: NetworkReading, first: FirstReading) -> bool:
    """Return whether a text is worded like a question about the scene, and the network is certain that it asks for nothing."""
    return not first.requests and second.answer == NOTHING and second.certainty >= CONTRARY


def _lacks_objects(second: NetworkReading, first: FirstReading) -> bool:
    """Return whether the network's goal lacks an object of the instruction that the grammar had no use for either."""
    everything = any(part.objects is None for part in second.goal.structures)
    named = set(second.goal.named_objects())
    return not (everything or first.keeps) and any(named.isdisjoint(each) for each in first.reading.left_over)


def _loses(goal: Goal, other: Goal) -> bool:
    """Return whether a goal lacks what another one was understood to ask for: an object, or a part among others."""
    fewer = len(goal.parts) < len(other.parts) and all(part in other.parts for part in goal.parts)
    everything = any(part.objects is None for part in goal.structures)
    return fewer or not (everything or set(other.named_objects()) <= set(goal.named_objects()))


def _other_references(goal: Goal, other: Goal) -> bool:
    """Return whether two goals are relations of the same objects with other references."""
    relations = [[part for part in one.parts if isinstance(part, RelationPart)] for one in (goal, other)]
    alone = all(len(found) == len(one.parts) for found, one in zip(relations, (goal, other), strict=True))
    same = [[(part.relation, part.objects) for part in found] for found in relations]
    return alone and same[0] == same[1] and goal != other


def _sorted(goal: Goal) -> bool:
    return any(part.order is not None or part.group_by is not None for part in goal.structures)


def _differ(goal: Goal, other: Goal, count: int | None) -> bool:
    """Return whether two goals differ; where no scene is known, in more than the words for objects."""
    if count is not None:
        return not compare_goals(goal, other, count).exact
    return _without_words(goal) != _without_words(other)


def _without_words(goal: Goal) -> list[str]:
    words = ("objects", "reference", "around")
    return sorted(
        str({key: value if key not in words else value is None for key, value in part.to_dict().items()})
        for part in goal.parts
    )


def doubted(second: NetworkReading, first: FirstReading, count: int | None) -> bool:
    """Decide whether a structure is not built because the grammar knows only a part of its instruction, and the network
    reads something else, or nothing.
    """
    if count is None or not first.half_read or not first.reading.residue:
        return False
    return second.goal is None or not supports(second.goal, first.goal)


def agrees(goal: Goal, slots: StructureSpec | None) -> bool:
    """Return whether a goal is the plain structure that the parser of the five slots reads: two readers, one goal."""
    return slots is not None and not more_than_plain(goal) and goal.structures[0].spec == slots


def _contradicts(goal: Goal, slots: StructureSpec) -> bool:
    """Return whether a plain structure has another value for a slot than the parser of five slots."""
    pairs = [(getattr(goal.structures[0], slot), getattr(slots, slot)) for slot in SLOTS]
    return any(one is not None and other is not None and one != other for one, other in pairs)


def supports(goal: Goal, plain: Goal, strictly: bool = False) -> bool:
    """Return whether a goal is a plain structure of the same objects with no other slots than this one has.

    The parser of the five slots knows more words for them than the network, which may leave some open.

    Args:
        goal: the network's.
        plain: the structure.
        strictly: whether all objects are others than some that are named.
    """
    if len(goal.parts) != 1 or more_than_plain(goal) or len(plain.parts) != 1:
        return False
    (one,), (other,) = goal.structures, plain.structures
    slots = ((getattr(one, slot), getattr(other, slot)) for slot in SLOTS)
    everything = None in (one.objects, other.objects) and not strictly
    same = everything or set(one.objects or ()) == set(other.objects or ())
    return same and all(read in (None, known) for read, known in slots)


def excepts(text: str) -> bool:
    """Return whether an instruction may leave something out of what it names."""
    return _EXCEPTION.search(text) is not None


def sorts(text: str) -> bool:
    """Return whether an instruction asks for an order of objects."""
    return _ORDERED.search(text) is not None


def keeps(text: str) -> bool:
    """Return whether an instruction may say what stays as it is."""
    return _KEPT.search(text) is not None


def notes_of(second: NetworkReading, first: GoalReading) -> tuple[str, ...]:
    """Return the notes on a goal that is used: what it says itself, and the words of which it holds nothing for certain.

    Words that it copied, for objects or lengths, are in the goal that the user sees. What the grammar took for an object, as
    the sun in "the sun is in the south, so ...", is named too.
    """
    uncopied = set(second.uncopied)
    taken = [one for one in first.goal.named_objects() if isinstance(one, str)]
    unread = [words for words in (*first.residue, *taken) if uncopied & set(re.findall(r"[^\W_]+", words.lower()))]
    return tuple(filter(None, (*second.notes, unread_note(unread, second.goal or Goal()))))
