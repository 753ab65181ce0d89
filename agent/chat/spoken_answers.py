"""Recognise the lines that decide a proposal or answer a question in a few fixed words."""

from __future__ import annotations

from grounding.dialogue.goal_revision import PART
from grounding.dialogue.second_opinion import AS_IT_IS
from grounding.parse_result import Question

YES = ("y", "yes", "yes please", "go", "go ahead", "do it", "build it", "ok", "okay", "sure")
NO = ("n", "no", "no thanks", "no thank you", "never mind", "nevermind")
_ANY = ("any", "either", "whatever", "i don't mind", "doesn't matter")


def bare_words(line: str) -> str:
    """Return a line in small letters, without the point or exclamation mark at its end."""
    return line.lower().rstrip(".!")


def is_yes_no(question: Question) -> bool:
    """Return whether a question offers a single goal, so that yes and no answer it."""
    goals = [option for option in question.options if option != AS_IT_IS]
    return question.slot == PART and len(goals) == 1


def chosen_option(line: str, question: Question) -> tuple[str | None] | None:
    """Return the option that a line chooses by its number, its exact words, or yes where only one goal is offered.

    Args:
        line: what was said.
        question: the question that is open.

    Returns:
        The option alone in a tuple, (None,) for words such as "any", which leave the slot open, and `None` if the line
        chooses none.
    """
    said = bare_words(line)
    options = {str(number): option for number, option in enumerate(question.options, start=1)}
    options |= {option.lower(): option for option in question.options}
    if said in options:
        return (options[said],)
    if said in YES and is_yes_no(question):
        return (question.options[0],)
    return (None,) if said in _ANY and question.slot != "shape" else None
