"""Ask whether a refused instruction means one of the goals that the network suggests for it."""

from __future__ import annotations

from grounding.dialogue.goal_revision import PART, GoalRevision, Turn
from grounding.goals.description import describe_parts
from grounding.parse_result import Question


def suggested(turn: Turn, found: GoalRevision) -> GoalRevision:
    """Return a question with the suggested goals in place of a refusal that has some; else what was found.

    What is said about a goal that is still to be built has suggestions of its own (`grounding.dialogue.second_opinion`).

    Args:
        turn: the sentence and the goal.
        found: what was made of it.
    """
    read = found.read
    if (turn.last.parts and turn.open) or found.status != "refused" or read is None or not (goals := read.suggest()):
        return found
    names = turn.said.names
    options = tuple(describe_parts(goal.parts, names) for goal in goals)
    which = "is this what is meant?" if len(options) == 1 else "is one of these meant?"
    question = Question(PART, f"{found.message}; {which}", options)
    return GoalRevision(turn.last, "ask", "new", question.text, question=question, choices=goals, read=read)
