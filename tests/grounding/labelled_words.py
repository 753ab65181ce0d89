"""Lead the words that a label copies to the objects of its scene, as if a network had written them."""

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.goal_rendition import AfterGoal, rendition_of
from grounding.goal_network.parts import parts_of
from grounding.goal_network.vocabulary import Action
from grounding.propose.proposal import WordedGoal
from grounding.propose.resolution import resolved
from grounding.training.goal_corrections import GoalCorrection, corrected, goals_of
from grounding.training.goal_lines import labelled


def resolved_label(row, encoder=None):
    """Return the proposal that the words of a label come to.

    Raises:
        LabelError: for a label that the network cannot write.
        UnreadLengthError: for a length that is not read.
    """
    objects, follows = goal_scenes()[row.scene], isinstance(row, GoalCorrection)
    task = corrected(row) if follows else labelled(row.text, row.label, scene=row.scene)
    actions = tuple(Action(kind, places[0]) for kind, places in task.steps[:-1])
    if not follows:
        read = parts_of(WrittenGoal(task.words, actions, 1.0), row.text)
        return resolved(WordedGoal(1.0, read.parts, read.kept, read.answer), row.text, objects, encoder)
    before = goals_of(row)[0]
    rendition = rendition_of(before, objects)
    read = parts_of(AfterGoal(task.words, actions, 1.0, rendition), " ".join(task.words))
    worded = WordedGoal(
        1.0, read.parts, read.kept, read.answer, known=rendition.known, before=before, about=rendition.text
    )
    return resolved(worded, row.text, objects, encoder)
