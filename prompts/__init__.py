"""Few-shot prompts as data: the text that a language model is shown, and the examples in it.

After the listing in paper appendix A.1, which maps an instruction to shape, size and location;
here to all five slots, and to the kind of request that it is ("parse_structure"), and to goals as JSON ("read_goal").
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from importlib import resources

# SHA-256 of every prompt's text as it is shipped; results that are published were made with these.
SHIPPED = {
    "parse_structure": "1d2f9fb9822ba18c190e86f6f09bf37b1af158299b639cfeeb71c5b2b10f6327",
    "read_goal": "c7ff39b1df70935a844b39a9124120b56877af8434e5f9f0e5209c886790269a",
}
# One example: an instruction's line, and the line of its answers, "name answer" for each.
_EXAMPLE = re.compile(r'^Instruction: "(?P<text>.+)"\nOutput: (?P<answers>.+)$', re.MULTILINE)


class PromptError(ValueError):
    """A prompt that is not there; the message lists those that are."""


def load_prompt(name: str) -> str:
    """The text of a prompt, such as "parse_structure".

    Raises:
        PromptError: for a name that is not in `prompt_names()`.
    """
    if name not in prompt_names():
        raise PromptError(f"there is no prompt {name!r}; available: {', '.join(prompt_names())}")
    return resources.files(__name__).joinpath(f"{name}.txt").read_text(encoding="utf-8")


def prompt_names() -> list[str]:
    """The names of all prompts, in alphabetical order."""
    entries = (entry.name for entry in resources.files(__name__).iterdir())
    return sorted(name.removesuffix(".txt") for name in entries if name.endswith(".txt"))


def prompt_examples(prompt: str) -> list[tuple[str, dict[str, str]]]:
    """The (instruction, name -> answer) pairs of a prompt's text, "NONE" as it stands there."""
    return [
        (match["text"], dict(answer.split(" ", maxsplit=1) for answer in match["answers"].split(", ")))
        for match in _EXAMPLE.finditer(prompt)
    ]


def prompt_lines(prompt: str) -> list[tuple[str, str]]:
    """The (instruction, output) pairs of a prompt's text, as they stand there."""
    return [(match["text"], match["answers"]) for match in _EXAMPLE.finditer(prompt)]


def with_examples(prompt: str, choose: Callable[[int], Iterable[int]]) -> str:
    """The prompt with other examples: `choose` gets their number and says which, in which order."""
    matches = list(_EXAMPLE.finditer(prompt))
    chosen = [matches[i][0] for i in choose(len(matches))]
    return prompt[: matches[0].start()] + "\n\n".join(chosen) + prompt[matches[-1].end() :]
