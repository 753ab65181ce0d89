"""Check the names that new figures get: no name of a shape, of a shipped figure, or word of sentences."""

from __future__ import annotations

from grounding.figures.drawings import DRAWING
from grounding.figures.figure import FigureError
from grounding.figures.names import LIKE, figure_nouns
from grounding.figures.words import WORD
from grounding.parse_result import shortened
from grounding.resolve.function_words import FUNCTION_WORDS
from grounding.structure_words import STRUCTURES


def checked_name(name: str, also_taught: bool = False) -> str:
    """Return a name for a figure, in small letters and without its article.

    Args:
        name: any string.
        also_taught: whether names of figures that were taught are taken, too.

    Raises:
        FigureError: for a name that a shape or a figure has, one of more than four words, or one without letters.
    """
    words = name.lower().split()
    said = " ".join(words[1:] if words[:1] in (["a"], ["an"], ["the"]) else words)
    if (
        not said
        or not all(word.replace("-", "").isalnum() for word in said.split())
        or len(said.split()) > 4
        or len(said) < 2
    ):
        raise FigureError(
            f"a figure cannot be called {shortened(name)!r}; legal: one to four words of letters and digits"
        )
    if said in FUNCTION_WORDS or said.startswith((LIKE, WORD, DRAWING)):
        raise FigureError(
            f"a figure cannot be called {said!r}, a word with another meaning in instructions; choose a noun, such "
            f"as 'city gate'"
        )
    shapes = {noun: shape.name for shape in STRUCTURES.values() for noun in (shape.name, *shape.words.nouns)}
    shipped = {noun.lower(): one for one, nouns in figure_nouns(taught=False).items() for noun in nouns}
    if (other := shapes.get(said) or shipped.get(said)) is not None:
        raise FigureError(
            f"{said!r} is {other!r} already, which comes with structagent; choose another name, such as 'my {said}'"
        )
    taught = {noun.lower() for one in figure_nouns().items() for noun in (one[0], *one[1])} if also_taught else ()
    if said in taught:
        raise FigureError(f"{said!r} is a figure of the user already; choose another name, such as 'other {said}'")
    return said
