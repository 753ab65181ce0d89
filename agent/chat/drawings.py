"""Show what a language model drew where it is asked about, and let it be named in the rest of a conversation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from agent.figures.picture import picture
from grounding.dialogue.state import Dialogue, Outcome
from grounding.dialogue.turns import Reader
from grounding.figures.names import figure_named
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.interpreter import Interpreter
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.resolve.attributes import SceneObject


@dataclass(frozen=True)
class KnowingReader(Reader):
    """A reader of sentences that knows the drawings of a conversation.

    Attributes:
        interpreter: reads the sentences.
        drawn: the shapes that were drawn and accepted, the latest last.
    """

    interpreter: Interpreter
    drawn: tuple[str, ...]

    @property
    def viewpoint(self) -> str:  # type: ignore[override]
        """Return whose left and right is spoken of."""
        return self.interpreter.viewpoint

    @property
    def encoder(self) -> SentenceEncoder:  # type: ignore[override]
        """Return the sentence encoder."""
        return self.interpreter.encoder

    def interpret(self, text: str, objects: Sequence[SceneObject], before: Goal = Goal()) -> Interpretation:
        """Interpret an instruction, or what is said about a goal."""
        return self.interpreter.interpret(text, objects, before, drawn=self.drawn)


def with_pictures(dialogue: Dialogue, outcome: Outcome) -> tuple[Dialogue, Outcome]:
    """Return what came of a sentence, with the picture of each drawing in front of the question that asks about it."""
    reading, question = outcome.reading, outcome.question
    if outcome.status != "ask" or question is None or reading is None or reading.drawn is None:
        return dialogue, outcome
    lines = [line for shape in reading.drawings for line in picture(figure_named(shape))]
    shown = replace(question, text="\n".join([*lines, question.text]))
    return replace(dialogue, question=shown), replace(outcome, question=shown)
