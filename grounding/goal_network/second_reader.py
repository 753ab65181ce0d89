"""Read an instruction a second time, with the goal network, and decide when its reading counts.

The grammar's reader builds nothing that has a word it does not know, which is safe and refuses much of what people say.
The network reads such sentences too, and says how certain it is. Its goal is used in place of a refusal, a question or
another goal only where it is certain, legal, feasible and free of contradictions; words that the grammar does not know
are then quoted in a note.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.parts import DIAMETER, UnreadLengthError, parts_of
from grounding.goal_network.vocabulary import NOTHING
from grounding.goal_network.writer import NetworkWriter, WrittenGoal
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.feasibility import infeasible, too_few
from grounding.goal_reading.reader import GoalReading, more_than_plain
from grounding.goal_reading.scene_references import ReadingQuestion, SceneReferences
from grounding.goal_reading.unread_words import unread_note
from grounding.goal_reading.written_references import UnusableGoalError, WrittenReferences
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart
from grounding.parse_result import Question
from grounding.references.attributes import SceneObject
from grounding.references.object_names import vocabulary
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS
from grounding.spec import SLOTS, StructureSpec

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

# Chosen on labelled instructions that neither the network nor the grammar's authors had seen (docs/parsing.md).
CERTAIN = 0.8  # in place of a refusal or a question, or of a larger goal where the parser of the five slots agrees
MORE_CERTAIN = 0.95  # in place of another goal, or of a refusal of what was understood and cannot be built
LIKELIEST = 5  # readings of a text: in four of ten corrections that the first one misses, another is right
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
# Words that change a wish wherever they occur: no goal can hold them, so a goal without them is another wish.
WEIGHTY = frozenset(
    "upside inverted lean leans leaning tilt tilted tilting rotate rotated rotating flip flipped sideways lid "
    "lids handle handles spout spouts label labels half halves alternate alternately alternating alternates "
    "degrees degree diagonal diagonally under beneath underneath hang hanging float floating hover hovering".split()
)
# Words that do so where the grammar does not know them.
WEIGHTY_IF_UNKNOWN = frozenset(
    "turn turned twist twisted lying upright open opened closed third quarter every twice again until unless "
    "parallel perpendicular angle angled without never balance balanced letter letters word words spell tomorrow "
    "later yesterday minutes seconds hours touch touches touching contact something somehow space room "
    "denser sparser trapezoid hexagon pentagon octagon rhombus".split()
)
_HALF_SHAPES = frozenset("circle circles moon ring round".split())  # after "half": an arc
_HALF_SIDES = frozenset("left right upper lower near nearer far farther front back rear top bottom".split())  # before it: a side
_EVERY_SOME = re.compile(r"\bevery (?:other|second|third|fourth|two|three|time|now|so)\b", re.IGNORECASE)
# Those of them that the labelled corrections have often, with goals that hold them.
_TAUGHT_IN_CORRECTIONS = frozenset("without open never".split())
_PARALLEL = frozenset("parallel perpendicular".split())  # of a line to an edge; no goal holds how an object lies
# An order that an instruction asks for.
_ORDERED = re.compile(
    r"\b(?:in (?:order|sequence) of|in (?:\w+ )?order|ordered|sort(?:ed)?|by (?:size|height|width|volume|weight))\b", re.IGNORECASE
)
_FAR = frozenset("far away farther further farthest furthest".split())


@dataclass(frozen=True)
class NetworkReading:
    """The network's reading of an instruction.

    Attributes:
        goal: what was read, in the speaker's frame; `None` where nothing was, or it cannot be used.
        certainty: from 0 to 1.
        question: what has to be settled first, as which of two objects is meant.
        nouns: that chose the objects.
        described: whether more than nouns chose the objects.
        notes: remarks for the user.
        uncopied: words of the instruction that are in no phrase for objects or lengths.
        unknown: those of them that the network was not taught, or that no goal can hold.
        answer: what was written in place of a goal, a word of `NO_GOAL`; "" for a goal.
        others: less likely readings of a correction, the likeliest first; those of the same goal are added up in one.
    """

    goal: Goal | None = None
    certainty: float = 0.0
    question: Question | None = None
    nouns: tuple[str, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    uncopied: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    answer: str = ""
    others: tuple[NetworkReading, ...] = ()


@dataclass
class SecondReader:
    """A reader of goals with the network, which is loaded at its first use.

    Args:
        writer: makes the network.
        encoder: finds what unknown nouns mean.
        opposite: whether the speaker sits across the table.
        corrector: makes the network that was taught corrections; without it none is read.
    """

    writer: InitVar[Callable[[], NetworkWriter]]
    encoder: SentenceEncoder | None = None
    opposite: bool = False
    corrector: InitVar[Callable[[], NetworkWriter] | None] = None

    def __post_init__(
        self, writer: Callable[[], NetworkWriter], corrector: Callable[[], NetworkWriter] | None
    ) -> None:
        self._instructions = _LazyWriter(writer)
        self._corrections = None if corrector is None else _LazyWriter(corrector)

    def read(
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, catalogue: bool = False
    ) -> NetworkReading:
        """Read an instruction; see `GoalReader.read`.

        Raises:
            GoalNetworkError: for weights that cannot be used.
        """
        written = self._instructions.write(text)  # a scene that is known later changes nothing here
        if written is None:
            return NetworkReading()
        return self._resolved(written, text, _scene_objects(objects), catalogue)

    def correct(self, goal: Goal, text: str, objects: Sequence[SceneObject | str | None]) -> NetworkReading:
        """Read what is said about a goal.

        Args:
            goal: so far, in the speaker's frame; its objects are indices.
            text: what is said.
            objects: of the scene.

        Returns:
            The whole goal after it.

        Raises:
            GoalNetworkError: for weights that cannot be used.
        """
        there = _scene_objects(objects) or []
        rendition = rendition_of(goal, there)
        if self._corrections is None or (DIAMETER.search(text) and "radius" in rendition.text):
            return NetworkReading()
        written = self._corrections.likeliest(f"{rendition.text} {text}")
        taught = self._corrections.network.taught_words
        found = list[NetworkReading]()
        for one in written:
            after = AfterGoal(one.words, one.actions, one.certainty, rendition)
            read = self._resolved(after, text, there)
            found.append(replace(read, certainty=one.certainty, unknown=_unknown(after.uncopied, taught)))
        if not found:
            return NetworkReading()
        first, *others = _added_up(found, len(there))
        return replace(first, others=tuple(others))

    def likeliest(self, text: str, objects: Sequence[SceneObject | str | None] | None = None) -> list[NetworkReading]:
        """Read an instruction in the likeliest ways, the most certain first; those of the same goal are added up in one.

        Args:
            text: the instruction.
            objects: of the scene; `None` where it is not known.

        Raises:
            GoalNetworkError: for weights that cannot be used.
        """
        there = _scene_objects(objects)
        found = [
            replace(self._resolved(one, text, there), certainty=one.certainty)
            for one in self._instructions.likeliest(text)
        ]
        return _added_up(found, None if there is None else len(there))

    def _resolved(
        self, written: WrittenGoal, text: str, there: list[SceneObject] | None, catalogue: bool = False
    ) -> NetworkReading:
        """Find the objects of a written goal."""
        names = None if there is None else [each.name for each in there]
        find = SceneReferences(there, self.encoder, catalogue, self.opposite)
        nouns = Vocabulary(FORMS) if names is None else vocabulary(names)
        known = written.rendition.known if isinstance(written, AfterGoal) else {}
        said = " ".join(written.words) if isinstance(written, AfterGoal) else text
        try:
            found = parts_of(written, said)
            if found.answer:
                return NetworkReading(certainty=written.certainty, answer=found.answer)
            goal = WrittenReferences(found.parts, find, nouns, found.kept, text, known).goal()
        except ReadingQuestion as doubt:
            return NetworkReading(certainty=written.certainty, question=doubt.question)
        except (UnusableGoalError, UnreadLengthError):
            return NetworkReading()
        listed = None if catalogue else names
        if contradiction(goal, listed) or (
            listed is not None and (infeasible(goal, listed) or too_few(goal, len(listed)))
        ):
            return NetworkReading()
        return NetworkReading(
            goal, written.certainty, None, tuple(dict.fromkeys(find.nouns)), find.described,
            tuple(dict.fromkeys(find.notes)), written.uncopied,
        )  # fmt: skip


@dataclass
class _LazyWriter:
    """A network that is loaded at its first use, and remembers what it wrote last."""

    make: Callable[[], NetworkWriter]
    _last: tuple[str, WrittenGoal | None] | None = field(default=None, repr=False)
    _last_likeliest: tuple[str, list[WrittenGoal]] | None = field(default=None, repr=False)

    @cached_property
    def network(self) -> NetworkWriter:
        return self.make()

    def write(self, text: str) -> WrittenGoal | None:
        if self._last is None or self._last[0] != text:
            self._last = text, self.network.write(text)
        return self._last[1]

    def likeliest(self, text: str) -> list[WrittenGoal]:
        if self._last_likeliest is None or self._last_likeliest[0] != text:
            self._last_likeliest = text, self.network.likeliest(text, LIKELIEST)
        return self._last_likeliest[1]


def _unknown(words: Sequence[str], taught: Collection[str]) -> tuple[str, ...]:
    """Return the words of a correction that the network was not taught, or that no goal can hold."""
    weighty = WEIGHTY_IF_UNKNOWN - _TAUGHT_IN_CORRECTIONS
    return tuple(word for word in words if word in weighty or (word[0].isalpha() and word not in taught))


def _added_up(readings: Sequence[NetworkReading], count: int | None) -> list[NetworkReading]:
    """Return readings of one text, those that come to the same as one, the most certain first."""
    found = list[NetworkReading]()
    for read in readings:
        like = next((n for n, each in enumerate(found) if _alike(each, read, count)), None)
        if like is None:
            found.append(read)
        else:
            found[like] = replace(found[like], certainty=found[like].certainty + read.certainty)
    return sorted(found, key=lambda each: -each.certainty)


def _alike(one: NetworkReading, other: NetworkReading, count: int | None) -> bool:
    """Return whether two readings come to the same goal, or to the same answer in place of one."""
    if one.goal is None or other.goal is None:
        return one.goal is other.goal and bool(one.answer) and one.answer == other.answer
    return one.goal == other.goal if count is None else compare_goals(one.goal, other.goal, count).exact


def _scene_objects(objects: Sequence[SceneObject | str | None] | None) -> list[SceneObject] | None:
    if objects is None:
        return None
    return [each if isinstance(each, SceneObject) else SceneObject(each or "") for each in objects]


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
    reading = first.reading
    settled = reading.work or reading.conditions or reading.never or reading.definite
    asked = first.requests or (second.certainty >= MORE_CERTAIN and not first.text.rstrip().endswith("?"))
    if second.goal is None or not asked or settled:
        return False
    if weighty(second.uncopied) or (first.asks_place and not (second.certainty >= MORE_CERTAIN and _has_place(second.goal))):
        return False
    if _PARALLEL & set(second.uncopied) and not any(part.along for part in second.goal.structures):
        return False
    if _lacks_objects(second, first) or brings_together(second) or (first.sorts and not _sorted(second.goal)):
        return False
    if reading.paired and any(isinstance(part, RelationPart) for part in second.goal.parts):
        return False  # the network knows no pairs
    agreed = agrees(second.goal, first.slots)
    if first.status == "ok":
        if agreed and not first.plain:
            return second.certainty >= CERTAIN
        if first.plain and (count is None or supports(second.goal, first.goal)):
            return False
        if not first.plain and reading.complete and not reading.corrected and _loses(second.goal, first.goal):
            return False
        enough = second.certainty >= (HALF_READ if first.half_read else MORE_CERTAIN)
        enough = enough and (first.half_read or not first.excepts)
        return enough and _differ(second.goal, first.goal, count)
    unknown = {word for words in reading.residue for word in re.findall(r"[a-z]+", words.lower())}
    if (unknown & (WEIGHTY | WEIGHTY_IF_UNKNOWN)) - _in_the_goal(second.goal, first.text):
        return False
    understood = bool(reading.problem) and not reading.residue and not agreed
    return second.certainty >= (MORE_CERTAIN if understood or first.idle else CERTAIN)


def weighty(words: Sequence[str]) -> bool:
    """Return whether words that no part of a goal was copied from change a wish wherever they occur."""
    for place, word in enumerate(words):
        if word == "half":
            before, after = words[:place][-1:], words[place + 1 : place + 2]
            if _HALF_SHAPES.isdisjoint(after) and _HALF_SIDES.isdisjoint(before):
                return True
        elif word in WEIGHTY:
            return True
    return False


def _in_the_goal(goal: Goal, text: str) -> set[str]:
    """Return the weighty words that a goal holds: the open side of an arc, all in "every block", half of a circle or a table."""
    words = {"half"}  # where it is no part of these it is in `weighty`
    if any(part.rotation is not None for part in goal.structures if part.shape in ("arc", "circle")):
        words |= {"open"}
    if not _EVERY_SOME.search(text):
        words |= {"every"}
    return words


def _has_place(goal: Goal) -> bool:
    """Return whether each part of a goal has a place on the table, or is beside something."""
    return all(
        isinstance(part, RelationPart) or part.along is not None or part.x_position is not None or part.y_position is not None
        for part in goal.parts
    )


def asks_nothing(second: NetworkReading, first: FirstReading) -> bool:
    """Return whether a text is worded like a question about the scene, and the network is certain that it asks for nothing."""
    return not first.requests and second.answer == NOTHING and second.certainty >= MORE_CERTAIN


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


def _sorted(goal: Goal) -> bool:
    return any(part.order is not None or part.group_by is not None for part in goal.structures)


def brings_together(second: NetworkReading) -> bool:
    """Return whether the network's goal puts something next to what the instruction wants it far from."""
    parts = () if second.goal is None else second.goal.parts
    relations = [part for part in parts if isinstance(part, RelationPart)]
    near = any(part.relation == "next to" and part.distance is None for part in relations)
    return near and "from" in second.uncopied and not _FAR.isdisjoint(second.uncopied)


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


def supports(goal: Goal, plain: Goal) -> bool:
    """Return whether a goal is a plain structure of the same objects with no other slots than this one has.

    The parser of the five slots knows more words for them than the network, which may leave some open.
    """
    if len(goal.parts) != 1 or more_than_plain(goal) or len(plain.parts) != 1:
        return False
    (one,), (other,) = goal.structures, plain.structures
    slots = ((getattr(one, slot), getattr(other, slot)) for slot in SLOTS)
    same = None in (one.objects, other.objects) or set(one.objects or ()) == set(other.objects or ())
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
