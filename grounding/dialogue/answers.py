"""Find which option of an open question a short answer means: a number, yes, "blue", "the first"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.goals.goal import Goal
from grounding.parse_result import OBJECT, Question
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.resolve.attributes import SceneObject
from grounding.resolve.errors import ResolveError
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.object_names import telling_words
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import singular

YES = (
    "y", "yes", "yes please", "yes build it", "yep", "yup", "yeah", "go", "go ahead", "go for it", "do it", "please do",
    "build", "build it", "ok", "okay", "sure", "right",
)  # fmt: skip
DECLINED = ("n", "no", "no thanks", "no thank you", "nope")
NO = (*DECLINED, "never mind", "nevermind", "neither", "none of them", "none of these")
_ANY = ("any", "either", "whatever", "i don't mind", "doesn't matter")
_ORDINALS = {"first": 0, "former": 0, "second": 1, "latter": 1, "third": 2, "last": -1}
_FILLERS = frozenset(
    "the a an one ones i mean meant it is that this please pls of and with to in on no yes just only rather actually "
    "choose take use option".split()
)
_WORD = re.compile(r"[^\W_]+")


def bare_words(line: str) -> str:
    """Return a line in small letters, without the point or exclamation mark at its end."""
    return " ".join(line.lower().split()).rstrip(".! ")


def is_yes_no(question: Question) -> bool:
    """Return whether a question offers a single goal, so that yes and no answer it."""
    return len(question.options) == 1


def chosen_options(
    line: str,
    question: Question,
    choices: Sequence[Goal] = (),
    objects: Sequence[SceneObject] = (),
    encoder: SentenceEncoder | None = None,
) -> tuple[int, ...]:
    """Return the numbers of the options that a line leaves, from 0: one where it chooses it, none for no answer.

    Args:
        line: what was said.
        question: that is open.
        choices: the goals behind its options.
        objects: of the scene.
        encoder: finds what unknown nouns mean.
    """
    said, options = bare_words(line), [option.lower() for option in question.options]
    if said.isdecimal():
        return (int(said) - 1,) if 1 <= int(said) <= len(options) else ()
    if said in options:
        return (options.index(said),)
    if (said in YES and is_yes_no(question)) or (said in _ANY and question.slot != "shape"):
        return (0,)
    words = [word for word in _WORD.findall(said) if word not in _FILLERS]
    if len(words) == 1 and words[0] in _ORDINALS and _ORDINALS[words[0]] < len(options):
        return (_ORDINALS[words[0]] % len(options),)
    if question.slot == OBJECT and (found := _object_meant(line, question, objects, encoder)) is not None:
        return (found,)
    return _by_words(words, question, choices, objects)


def _object_meant(
    line: str, question: Question, objects: Sequence[SceneObject], encoder: SentenceEncoder | None
) -> int | None:
    """Return the option whose object alone the words describe."""
    by_name = {one.name: one for one in objects}
    offered = [by_name[name] for name in question.options if name in by_name]
    if len(offered) != len(question.options):
        return None
    for said in dict.fromkeys((line, line.replace(",", " "))):  # "the cup on the left, of the white ones"
        try:
            found = resolve_phrase(said, Referents(offered, encoder)).indices
        except ResolveError:
            continue
        if len(found) == 1 < len(offered):
            return found[0]
    return None


def _by_words(
    words: Sequence[str], question: Question, choices: Sequence[Goal], objects: Sequence[SceneObject]
) -> tuple[int, ...]:
    """Return the options that have all words of an answer, in their text or in names that not all of them have."""
    named = [set(goal.named_objects()) for goal in choices] or [set() for _ in question.options]
    shared = set.intersection(*named)
    own = list[set[str]]()
    for number, option in enumerate(question.options):
        has = {singular(word) for word in _WORD.findall(option.lower())}
        for index in named[number] - shared:
            if isinstance(index, int) and index < len(objects):
                has |= telling_words(objects[index])
        has |= next((telling_words(one) for one in objects if one.name.lower() == option.lower()), set())
        own.append(has)
    meant = [number for number, has in enumerate(own) if words and all(singular(word) in has for word in words)]
    return tuple(meant) if len(meant) < len(question.options) else ()
