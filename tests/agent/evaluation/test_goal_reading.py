"""The benchmark of goals counts the readings that are a language model's own."""

import io
from dataclasses import replace

from agent.evaluation.goal_reading import measure_goal_reading, print_goal_reading
from grounding.goal_benchmark.rows import GoalRow
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.interpretation import Interpretation
from grounding.parse_result import Parse
from grounding.spec import StructureSpec

TOWER, LINE = (Goal((StructurePart(shape, objects=("cans",)),)) for shape in ("tower", "line"))
ROWS = [
    GoalRow("stack the cans", None, "one", "ok", (TOWER,)),
    GoalRow("line up the cans", None, "one", "ok", (LINE,)),
    GoalRow("pile up the cans", None, "one", "ok", (TOWER,)),
]


class Reading:
    """An interpreter that reads a tower in everything; of what begins with a word it says that a model read it."""

    def __init__(self, *by_model):
        self.by_model = by_model

    def interpret(self, text, objects):
        spec = StructureSpec("tower")
        found = Interpretation(Parse(text, spec, "llm"), spec, "ok", "", "robot", None, 0.01, goal=TOWER)
        return replace(found, by_model=text.startswith(self.by_model))

    def interpret_many(self, texts, objects):
        return [self.interpret(text, objects) for text in texts]


def test_a_models_own_readings_are_counted_with_their_exact_ones():
    found = measure_goal_reading(Reading("stack", "line"), ROWS, lambda done: None, {})
    assert found["exact"]["hits"] == 2 and found["exact"]["n"] == 3
    assert (found["by_model"]["hits"], found["by_model"]["n"]) == (1, 2)
    none = measure_goal_reading(Reading("swap"), ROWS, lambda done: None, {})
    assert none["by_model"]["n"] == 0 and none["by_model"]["rate"] is None
    printed = io.StringIO()
    sets = (("a", found), ("b", none))
    print_goal_reading([{"parser": "llm", "data": name, "rows": 3} | one for name, one in sets], printed)
    head, below, first, second = printed.getvalue().split("\n\n")[1].splitlines()
    assert head.split()[-2:] == ["own", "own"] and below.split()[-1] == "exact"
    assert first.split()[-2:] == ["2", "50.0"] and second.split()[-2:] == ["0", "-"]
