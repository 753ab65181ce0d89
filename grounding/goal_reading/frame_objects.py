"""Find the objects that the noun phrases of a frame mean, pronouns and structures among them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from grounding.goal_reading.antecedents import Antecedents
from grounding.goal_reading.drafts import Draft, ImpossibleError, objects_of
from grounding.goal_reading.frame import RELATIONAL, Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goals.parts import Objects, PartReference
from grounding.parse_result import OBJECT, Question, shortened
from grounding.references.phrases import ANY

_SOME_OF = re.compile(r"(?:\d+|one|two|three|four|five|six|some|a few|a couple) of\b", re.IGNORECASE)


class FrameObjects:
    """The finding of the objects of one instruction's frames.

    Args:
        text: the instruction.
        drafts: of the parts so far; the list grows.
        references: finds the objects that noun phrases mean.
        known: what was spoken of.
    """

    def __init__(self, text: str, drafts: list[Draft], references: SceneReferences, known: Antecedents) -> None:
        self.text, self.drafts, self.find, self.known = text, drafts, references, known
        self._owner: Objects = None  # what "its left" was said of last
        self._meant: dict[tuple[tuple[int, int], ...], Objects] = {}  # pronouns by their places in the text

    def objects(
        self,
        phrases: Sequence[NounPhrase],
        pairs: bool = False,
        fits: Callable[[tuple[Any, ...]], bool] | None = None,
    ) -> Any:
        """Find the objects of several noun phrases: a tuple, the structure of a part, or `None` for all that is left.

        Args:
            phrases: of one frame, or of one relation.
            pairs, fits: as `Antecedents.meant` takes them.
        """
        if (members := self._members(phrases)) is not None:
            return members
        found: list[Any] = []
        for phrase in phrases:
            if phrase.kind in ("all", "rest"):
                if len(phrases) > 1:
                    raise ReadingError(
                        f"{phrase.text!r} cannot be joined with other objects in {shortened(self.text)!r}"
                    )
                return self._everything(phrase)
            if phrase.kind == "structure":
                return PartReference(self.structure_of(phrase))
            if phrase.kind == "pronoun":
                if found and phrase.many:
                    continue  # "the cups, all of them, in a row"
                meant = self.known.meant(phrase, pairs, fits)
                if phrase.without:
                    return self._without(phrase, meant)
                if isinstance(meant, PartReference) or meant is None:
                    if meant is None and not phrase.many:
                        self.ask_which(phrase.text)
                    return meant
                found += [one for one in meant if one not in found]
                continue
            if landmark := self.find.landmark_of(phrase):  # "the cup by the bowl in front of it"
                self.known.mentioned.append((landmark, len(landmark) > 1))
                self.known.before = len(self.known.mentioned)
            objects = self.find.find(phrase)
            found += [one for one in objects if one not in found]
            self.known.mentioned.append((objects, phrase.many))
        out = {one for phrase in phrases for one in self.find.left_out_of(phrase)}
        left = tuple(one for one in found if one not in out)
        if found and not left:
            raise ReadingError(f"nothing is left of {phrases[-1].text!r} in {shortened(self.text)!r}")
        return left or None

    def _without(self, phrase: NounPhrase, meant: Any) -> Any:
        """Return what a pronoun means, without what is left out of it: "all of them but the red one"."""
        if isinstance(meant, PartReference):
            meant = self.drafts[meant.part].objects
        if meant is None:
            return self._everything(phrase)
        out = self._left_out(phrase)
        return tuple(one for one in meant if one not in out)

    def _left_out(self, phrase: NounPhrase) -> set[Any]:
        """Find what a phrase leaves out."""
        left_out: set[Any] = set()
        for without in phrase.without:
            if _SOME_OF.match(without.text):  # which two, and whether the rest is of the same kind, is not said
                raise ImpossibleError(
                    f"it is not clear which objects {without.text!r} leaves out in {shortened(self.text)!r}; name them"
                )
            out = self.objects([without])
            if isinstance(out, PartReference):
                out = self.drafts[out.part].objects
            if out is None:
                raise ReadingError(
                    f"it is not clear which objects {without.text!r} leaves out in {shortened(self.text)!r}; name them"
                )
            left_out.update(out)
        return left_out

    def among(self, objects: Sequence[Any], phrase: NounPhrase) -> tuple[Any, ...]:
        """Return those of some objects that a phrase fits: "the red one" of the cans."""
        if self.find.objects is None or self.find.catalogue:
            return ()
        return tuple(one for one in self.find.fitting(phrase) if one in objects)

    def _members(self, phrases: Sequence[NounPhrase]) -> tuple[Any, ...] | None:
        """Return the objects of "the cans: red, blue, green", a group and its members, in the order of the members.

        Raises:
            ReadingError: where only some of the group are named.
        """
        borrowed = len(phrases) > 2 and phrases[0].kind == "objects" and phrases[0].many and all(one.borrowed for one in phrases[1:])
        if not borrowed or self.find.objects is None or self.find.catalogue:
            return None
        group = self.find.find(phrases[0])
        said = [self.among(group, phrase) for phrase in phrases[1:]]
        if any(not one or (len(one) > 1 and not phrase.many) for one, phrase in zip(said, phrases[1:], strict=True)):
            return None
        members = tuple(dict.fromkeys(one for each in said for one in each))
        if len(members) < len(group):
            words = ", ".join(phrase.text for phrase in phrases[1:])
            raise ReadingError(f"{words!r} in {shortened(self.text)!r} are only some of {phrases[0].text!r}")
        self.known.mentioned.append((members, True))
        return members

    def _everything(self, phrase: NounPhrase) -> Any:
        left_out = self._left_out(phrase)
        if phrase.mention is not None and phrase.kind == "rest":
            same = self.find.find(phrase)
            taken = self._taken()
            rest = tuple(one for one in same if one not in taken)
            if not rest:
                raise ReadingError(f"nothing is left for {phrase.text!r} in {shortened(self.text)!r}")
            return rest
        if phrase.left is not None and (
            others := self.find.rest(
                phrase,
                self._taken()
                | left_out
                | self.known.left_out,
            )
        ):
            return others
        if not left_out:
            return self._others_of_kind(phrase) or None
        if self.find.count is None:
            return (f"everything but {' and '.join(map(str, sorted(left_out, key=str)))}",)
        others = tuple(i for i in range(self.find.count) if i not in left_out)
        if not others:
            raise ReadingError(f"nothing is left for {phrase.text!r} in {shortened(self.text)!r}")
        return others

    def _taken(self) -> set[Any]:
        """Return the objects that the parts so far name as their own or as a reference."""
        return {one for part in self.drafts for one in (*(part.objects or ()), *objects_of(part.relation))}

    def _others_of_kind(self, phrase: NounPhrase) -> tuple[int, ...]:
        """Return the others of a kind of which only some were spoken of: "one can on the plate, the others in a row"."""
        before = self.known.frame
        known = self.find.objects is not None and not self.find.catalogue
        if phrase.kind != "rest" or not known or before is None or len(before.objects) != 1:
            return ()
        some = before.objects[0].mention
        if some is None or some.noun == ANY or some.definite or not some.count:
            return ()
        taken = self._taken()
        kind = self.find.candidates.matching(replace(some, count=None, exact=False))
        return tuple(one for one in kind if one not in taken) if len(kind) > some.count else ()

    def structure_of(self, phrase: NounPhrase) -> int:
        """Return the number of the structure that a phrase such as "the row" means."""
        if phrase.text.startswith("#"):
            structures = [i for i, draft in enumerate(self.drafts) if draft.values is not None]
            if int(phrase.text[1:]) < len(structures):
                return structures[int(phrase.text[1:])]
        for number in range(len(self.drafts) - 1, -1, -1):
            values = self.drafts[number].values
            if values is not None and values.get("shape") == phrase.text:
                return number
        raise ReadingError(f"{shortened(self.text)!r} speaks of a {phrase.text} that it does not ask for")

    def reference(self, frame: Frame, predicate: Predicate) -> Objects:
        """Find what a relation is said of."""
        phrases = predicate.reference
        if not phrases:
            before = self.known.frame
            if (
                predicate.kind == "relation it"
                and self._owner is not None
                and before is not None
                and before.has("relation it")
                and before.sentence == frame.sentence
            ):
                self.known.keep(self._owner, NounPhrase("pronoun", 0, 0, "it"))
                return self._owner  # "the fork to its left, the knife to its right"
            pronoun = NounPhrase("pronoun", 0, 0, "them" if predicate.value == "between" else "it")
            found = self.known.meant(pronoun, fits=self._fitting(predicate))
            self._owner = found if predicate.kind == "relation it" else self._owner
            self.known.keep(found, pronoun)
        else:
            # "left of it ... and to its right": the same pronoun, said of a second part, still means the same
            key = tuple((phrase.first, phrase.end) for phrase in phrases if phrase.kind == "pronoun")
            if key and key in self._meant:
                return self._meant[key]
            found = self._chained(predicate, phrases)
            if found is None:
                found = self.objects(phrases, pairs=predicate.value == "between", fits=self._fitting(predicate))
            if len(phrases) == 1 and phrases[0].kind == "pronoun":
                self.known.keep(found, phrases[0])
            elif isinstance(found, PartReference):  # "behind the row"
                self.known.mentioned.append((found, False))
            if key and found is not None:
                self._meant[key] = found
        if found is None:
            raise ReadingQuestion(
                Question(
                    OBJECT,
                    f"{predicate.said!r} in {shortened(self.text)!r}: of which object?",
                    tuple(self.find.candidates.names) if self.find.candidates else (),
                )
            )
        return found

    def _chained(self, predicate: Predicate, phrases: Sequence[NounPhrase]) -> tuple[Any, ...] | None:
        """Return what was placed last, if "that" is said in the same relation: "behind the box, and the can behind that"."""
        before = self.known.frame
        if len(phrases) != 1 or phrases[0].text.lower() not in ("that", "that one") or before is None:
            return None
        same = any(each.kind == "relation" and each.value == predicate.value for each in before.predicates)
        last = self.known.last
        return last if same and last is not None and not set(last) & set(self.find.subject or ()) else None

    def _fitting(self, predicate: Predicate) -> Callable[[tuple[Any, ...]], bool]:
        """Return what tells whether objects can be what a relation is said of: not what is placed; for "in" a vessel."""
        subject, candidates = self.find.subject or (), self.find.candidates
        covered = self._covered("top" in predicate.said.lower()) if predicate.value == "on" else set()

        def fits(objects: tuple[Any, ...]) -> bool:
            if set(objects) & set(subject) or set(objects) & covered:
                return False
            return predicate.value != "in" or candidates is None or all(candidates.holds(one) for one in objects)

        return fits

    def _covered(self, on_top: bool) -> set[Any]:
        """Return what carries another object of a stack: "stack the tuna can on the soup can and the orange on top"."""
        before = self.known.frame
        if before is None or not (on_top or before.verb_said.lower().startswith(("stack", "pil"))):
            return set()
        carried = (part.relation for part in self.drafts if part.relation is not None and part.relation.relation == "on")
        return {one for each in carried if isinstance(each.reference, tuple) for one in each.reference}

    def references(self, frame: Frame) -> dict[int, Objects]:
        """Find what each relation of a frame is said of: its first word -> the objects."""
        return {
            each.first: self.reference(frame, each) for each in frame.predicates
            if each.kind in RELATIONAL and each.value != "around"
        }  # fmt: skip

    def ask_which(self, words: str) -> None:
        """Ask which object is meant.

        Raises:
            ReadingQuestion: always.
        """
        options = tuple(self.find.candidates.names) if self.find.candidates is not None else ()
        raise ReadingQuestion(
            Question(OBJECT, f"which object is meant with {words!r} in {shortened(self.text)!r}?", options)
        )
