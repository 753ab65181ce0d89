"""How conversations end that others wrote and labelled: `python -m tests.grounding.dialogue.rates` measures them all.

Whole conversations, of two to six turns, stand in `goal_dialogues.jsonl.xz` (`xzcat` prints it) as what is said and the
goals, questions or refusals that are right after it. Single corrections stand in `unseen_corrections*.tsv` and
`seen_corrections_d.tsv` in the form of `grounding/language/goal_corrections.tsv.xz`; labels that are equally fair are
divided by "||".

Each set is of another writer who knew nothing of the reader. Nobody opens the sets that are called "unseen", of which
rates only are known; with the other ones corrections were developed.
"""

from __future__ import annotations

import csv
import json
import lzma
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from grounding.dialogue.state import Dialogue
from grounding.dialogue.turns import answer, say
from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.vocabulary import NO_GOAL
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.training.goal_corrections import GoalCorrection, goal_of
from tests.grounding.goal_in_words import goal_of_words
from tests.grounding.side_by_side import Conversation, ReadBefore, side_by_side

FOLDER = Path(__file__).parent
_ANSWERS = ("ask", "refused", "unchanged")


def dialogues() -> list[dict[str, Any]]:
    """Load all dialogues, each with its "set"."""
    lines = lzma.decompress((FOLDER / "goal_dialogues.jsonl.xz").read_bytes()).decode().splitlines()
    return [json.loads(line) for line in lines]


def corrections(file: str) -> list[GoalCorrection]:
    """Load the single corrections of a file, but for those that need arithmetic: their goals are not labelled."""
    lines = (FOLDER / file).read_text(encoding="utf-8").splitlines()
    rows = (GoalCorrection(*row) for row in csv.reader(lines, delimiter="\t", quoting=csv.QUOTE_NONE))
    return [row for row in rows if row.after != "computed."]


def dialogue_end(reader: ReadBefore, dialogue: Mapping[str, Any]) -> Conversation[str]:
    """Hold a dialogue up to its first wrong turn; return "right", "offered" if questions had to be answered, "wrong" if
    something else was built before any answer, or "refused". A question is answered with the right goal where that is
    one of its answers.
    """
    objects, answered = goal_scenes()[dialogue["scene"]], 0
    names = [one.name for one in objects]
    state = Dialogue()
    for each in dialogue["turns"]:
        yield state, each["say"], objects, ()
        state, found = say(state, each["say"], reader, objects)
        refused = found.status in ("refused", "nothing", "unchanged", "ask") and "refused" in each["then"]
        asked = found.status == "ask" and "ask" in each["then"]
        if found.status == "ask" and not (refused or asked):
            right = [number for number, one in enumerate(state.choices) if _is(one, each["then"], len(objects))]
            if right:
                state, found = answer(state, right[0], names)
                answered += 1
        same = found.status == "unchanged" and _is(state.goal, each["then"], len(objects))
        if not (refused or asked or same or (found.status == "ok" and _is(found.goal, each["then"], len(objects)))):
            return "wrong" if found.status == "ok" and not answered else "refused"
    return "offered" if answered else "right"


def _is(goal: Goal, expected: Sequence[str], count: int) -> bool:
    """Return whether a goal is one of those expected."""
    return any(compare_goals(goal, goal_of_words(each), count).exact for each in expected if each not in _ANSWERS)


def correction_end(reader: ReadBefore, row: GoalCorrection) -> Conversation[str]:
    """Say a correction; return whether it is "right", "offered" among the answers of a question, "wrong" or "refused";
    where no goal is right, "built" or "not built".
    """
    objects = goal_scenes()[row.scene]
    before = goal_of(row.before, len(objects))
    labels = [label.strip(" .") for label in row.after.split("||")]
    wanted = [goal_of(label, len(objects)) for label in labels if label not in NO_GOAL]

    def right(goal: Goal) -> bool:
        return any(compare_goals(goal, one, len(objects)).exact for one in wanted)

    yield Dialogue(before), row.text, objects, ()
    state, found = say(Dialogue(before), row.text, reader, objects)
    if not wanted:
        return "built" if found.status == "ok" else "not built"
    if found.status == "ok":
        return "right" if right(found.goal) else "wrong"
    if found.status == "unchanged" and right(before):
        return "right"
    return "offered" if found.status == "ask" and any(map(right, state.choices)) else "refused"


@cache
def sets() -> dict[str, tuple[Callable[[ReadBefore, Any], Conversation[str]], list[Any]]]:
    """Load all sets: what holds a conversation of each, and its conversations."""
    found: dict[str, tuple[Callable[[ReadBefore, Any], Conversation[str]], list[Any]]] = {}
    for one in dialogues():
        found.setdefault(f"dialogues {one['set']}", (dialogue_end, []))[1].append(one)
    for path in sorted(FOLDER.glob("*seen_corrections*.tsv")):
        found[f"corrections {path.stem.replace('_corrections', '')}"] = correction_end, corrections(path.name)
    return found


def ends(interpreter: Interpreter, name: str, every: int = 1) -> Counter[str]:
    """Return how each `every`-th conversation of a set ends."""
    end_of, rows = sets()[name]
    return Counter(side_by_side(interpreter, lambda reader: [end_of(reader, row) for row in rows[::every]]))


def main() -> None:
    """Print the table of all sets."""
    from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter

    columns = ("right", "offered", "wrong", "refused", "built", "not built")
    print("set", "n", *columns, sep="\t")
    interpreter = make_interpreter(ReadingOptions())
    for name in sets():
        found = ends(interpreter, name)
        print(name, found.total(), *(found[each] for each in columns), sep="\t", flush=True)


if __name__ == "__main__":
    main()
