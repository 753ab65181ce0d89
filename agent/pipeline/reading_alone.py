"""Read many texts so that one at which the program fails costs itself and no other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from agent.errors import defect_sentence, is_defect
from grounding.interpretation import Interpretation, Objects
from grounding.parse_result import DEFECT, Parse
from grounding.spec import StructureSpec

T = TypeVar("T")


class Reads(Protocol):
    """A reader of texts: `grounding.interpreter.Interpreter`, or a parser of the five slots alone."""

    @property
    def viewpoint(self) -> str:
        """Return whose left and right is meant."""

    @property
    def name(self) -> str:
        """Return the name of the parser of the five slots."""

    def interpret_many(self, texts: Sequence[str], objects: Objects | None) -> list[Interpretation]:
        """Interpret each of many texts."""


def itself(reading: Interpretation) -> Interpretation:
    """Return a reading as it is, for `read_alone`."""
    return reading


def read_alone(
    interpreter: Reads,
    texts: Sequence[str],
    objects: Objects | None,
    use: Callable[[Interpretation], T],
) -> list[T]:
    """Read texts together; where the program fails, each of them alone, so that the others are read all the same.

    Args:
        interpreter: of the texts.
        texts: any strings.
        objects: what is there, as for `Interpreter.interpret`.
        use: makes a result of a reading. What it raises counts as a failure of its text.

    Returns:
        A result for each text; a text at which the program failed has a reading with the status `DEFECT`, and a
        sentence.

    Raises:
        Exception: what is no defect, such as a language model that does not answer.
    """
    try:
        return [use(one) for one in interpreter.interpret_many(texts, objects)]
    except Exception as error:
        if not is_defect(error):
            raise
        if len(texts) > 1:
            return [one for text in texts for one in read_alone(interpreter, [text], objects, use)]
        message = defect_sentence(error)
        parse = Parse(texts[0], StructureSpec(), interpreter.name, DEFECT, message)
        return [use(Interpretation(parse, StructureSpec(), DEFECT, message, interpreter.viewpoint, None, 0.0))]
