"""With a language model that is always right, the tool builds what it says: instructions and corrections alike.

The texts of the held-out and unseen files are read by nobody; rates only.
"""

from grounding.goals.comparison import compare_goals
from grounding.interpreter import Interpreter
from grounding.language_model.goal_model import GoalModel
from grounding.parsers.llm_endpoint import EndpointLLM
from tests.grounding.language_model.oracle import MODEL, Oracle, correction_rows, instruction_rows, serving_oracle

LEAST = 0.98
STATUSES = {"build": "ok", "ask": "ask", "refuse": "refused", "none": "refused"}


class NoNetwork:
    """Reads nothing: what the model says must do."""

    fallback, name = "", "none"

    def propose(self, *given):
        return ()


def is_right(interpreter, row):
    """Whether what is built, asked or refused is what the model said."""
    read = interpreter.interpret(row.text, row.objects, row.before)
    if read.fallback or read.status != STATUSES[row.decision]:
        return False
    return (
        row.goal is None or compare_goals(read.goal, row.goal, None if row.objects is None else len(row.objects)).exact
    )


def rate(rows, parser, encoder, verifier):
    with serving_oracle(Oracle(rows)) as oracle:
        model = GoalModel(EndpointLLM(oracle.url, MODEL))
        interpreter = Interpreter(
            lambda: parser, encoder, NoNetwork(), lambda: verifier, model=lambda: model, instead=lambda: parser
        )
        right = sum(is_right(interpreter, row) for row in rows)
        assert all("response_format" in body for body in oracle.requests)
    return right / len(rows)


def test_instructions(parser, encoder, verifier):
    files = ("free", "held_out", "held_out_b", "held_out_c", "held_out_d", "held_out_e")
    rows = [row for name in files for row in instruction_rows(f"goals_{name}.jsonl")]
    assert len(rows) == 1060
    # 0.998: a cup is taken out of a table setting, a cross has four objects.
    assert rate(rows, parser, encoder, verifier) >= LEAST


def test_corrections(parser, encoder, verifier):
    rows = [row for name in ("", "_b", "_d", "_e", "_f") for row in correction_rows(f"unseen_corrections{name}.tsv")]
    assert len(rows) == 864
    assert rate(rows, parser, encoder, verifier) >= LEAST  # 0.995: circles, an arc and a pyramid of two objects
