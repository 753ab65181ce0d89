"""Read a text with the goal network: an instruction, or what is said about a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.parts import DIAMETER, UnreadLengthError, parts_of
from grounding.goal_network.weighty_words import unknown_words
from grounding.goal_network.writer import NetworkWriter, WrittenGoal
from grounding.goal_reading.contradictions import contradiction
from grounding.goal_reading.feasibility import infeasible, too_few
from grounding.goal_reading.scene_references import ReadingQuestion, SceneReferences
from grounding.goal_reading.written_references import UnusableGoalError, WrittenReferences
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.references.attributes import SceneObject
from grounding.references.object_names import vocabulary
from grounding.references.phrases import Vocabulary
from grounding.references.word_forms import FORMS

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

LIKELIEST = 5  # readings of a text: in four of ten corrections that the first one misses, another is right


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
        there = _scene_objects(objects)
        written = self._instructions.write(text, None if catalogue else there)
        if written is None:
            return NetworkReading()
        return self._resolved(written, text, there, catalogue)

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
        written = self._corrections.likeliest(f"{rendition.text} {text}", there)
        taught = self._corrections.network.taught_words
        found = list[NetworkReading]()
        for one in written:
            after = AfterGoal(one.words, one.actions, one.certainty, rendition)
            read = self._resolved(after, text, there)
            found.append(replace(read, certainty=one.certainty, unknown=unknown_words(after.uncopied, taught)))
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
            for one in self._instructions.likeliest(text, there)
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
    _last: tuple[_Said, WrittenGoal | None] | None = field(default=None, repr=False)
    _last_likeliest: tuple[_Said, list[WrittenGoal]] | None = field(default=None, repr=False)

    @cached_property
    def network(self) -> NetworkWriter:
        return self.make()

    def write(self, text: str, objects: Sequence[SceneObject] | None = None) -> WrittenGoal | None:
        said = _said(text, objects)
        if self._last is None or self._last[0] != said:
            self._last = said, self.network.write(text, objects)
        return self._last[1]

    def likeliest(self, text: str, objects: Sequence[SceneObject] | None = None) -> list[WrittenGoal]:
        said = _said(text, objects)
        if self._last_likeliest is None or self._last_likeliest[0] != said:
            self._last_likeliest = said, self.network.likeliest(text, LIKELIEST, objects)
        return self._last_likeliest[1]


_Said = tuple[str, tuple[SceneObject, ...] | None]


def _said(text: str, objects: Sequence[SceneObject] | None) -> _Said:
    """Return what the network is asked about."""
    return text, None if objects is None else tuple(objects)


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
