"""A reader of conversations that was told what each sentence means, for tests of what is made of it."""

from dataclasses import dataclass, field

from grounding.dialogue.turns import GOAL
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.parse_result import Parse, Question
from grounding.spec import StructureSpec
from tests.grounding.goal_in_words import goal_of_words


@dataclass
class ScriptedReader:
    """Knows for each sentence, or for "GOAL SO FAR > sentence", what it means.

    A meaning is a goal in words; "? GOAL | GOAL" asks which is meant; "! REASON" refuses, "! REASON ! GOAL" a goal that
    cannot be had; "-" asks for nothing; "=" is the goal so far. What it was not told is refused. With a key "*",
    sentences without a goal so far have that meaning only without one.
    """

    script: dict
    viewpoint: str = "robot"
    encoder: object = None
    asked: list = field(default_factory=list)

    def goal(self, text):
        goal = goal_of_words(text)
        return goal.turned() if self.viewpoint == "opposite" else goal

    def interpret(self, text, objects=None, before=Goal()):
        self.asked.append((str(before), text))
        said = self.script.get(
            f"{before} > {text}", self.script.get(text) if not before.parts or "*" not in self.script else None
        )
        common = {"slots": Parse(text, StructureSpec(), "scripted"), "spec": StructureSpec(),
                  "viewpoint": self.viewpoint,
                  "objects": None, "seconds": 0.0}  # fmt: skip
        if said is None:
            return Interpretation(status="refused", message=f"{text!r} was not understood", **common)
        if said in ("-", "="):
            return Interpretation(status="refused",
                                  message="does not ask for an arrangement" if said == "-" else "that is already so",
                                  nothing=said == "-", unchanged=said == "=", **common)  # fmt: skip
        if said.startswith("!"):
            _, reason, *wish = (each.strip() for each in said.split("!"))
            return Interpretation(status="refused", message=reason, wish=self.goal(*wish) if wish else Goal(), **common)
        if said.startswith("?"):
            goals = tuple(self.goal(each.strip()) for each in said[1:].split("|"))
            options = tuple(describe_parts(goal.parts, [one.name for one in objects]) for goal in goals)
            question = Question(GOAL, f"which of these is meant: {'; or: '.join(options)}?", options)
            return Interpretation(status="ask", message=question.text, question=question, choices=goals, **common)
        return Interpretation(status="ok", message="", goal=self.goal(said), probability=0.9, **common)
