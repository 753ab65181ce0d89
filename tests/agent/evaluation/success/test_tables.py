"""The tables of given rows: what stands in them, and which there are."""

import pytest

from agent.evaluation.success.tables import markdown_of, tables_of
from structdiffusion.benchmark.success import Evaluation


def evaluation(model, outcomes, structure="line"):
    """The evaluation of a model whose scenes end as told: the rank of the first success, or a failure class."""
    rows = []
    for number, outcome in enumerate(outcomes):
        rank = outcome if isinstance(outcome, int) else None
        failure = None if rank == 1 else "semantic" if rank else outcome
        rows.append(
            {
                "structure": structure, "number": number, "seed": 7, "success": rank == 1, "failure": failure,
                "first_success_rank": rank, "plan_seconds": 2.0, "seconds": 3.0,
                "verdicts": [{"penetrated": "table" if outcome == "intersection" else None}],
            }
        )  # fmt: skip
    return Evaluation(tuple(rows), 2, {"model": model, "candidates": 64}).to_dict()


def report(*evaluations):
    return {"version": "1.2", "command": "structagent evaluate success --seed 7", "evaluations": list(evaluations)}


def table(found, title):
    (match,) = [one for one in tables_of(found) if one.title == title]
    return [dict(zip(match.head, row, strict=True)) for row in match.rows]


def test_success_and_failures_in_the_papers_layout():
    found = report(evaluation("geometric", [1, 1, 2, "intersection"]))
    row, *papers = table(found, "Success per method and structure")
    assert row == {"model": "geometric", "n": "4", "line": "50.0 (15.0-85.0)", "all": "50.0 (15.0-85.0)"}
    assert papers[1] == {"model": "paper: sentence", "n": "-", "line": "67", "all": "-"}
    (row,) = table(found, "Success within k arrangements")
    assert (row["success@1"], row["success@2"]) == ("50.0 (15.0-85.0)", "75.0 (30.1-95.4)")
    ours, *papers = table(found, "Failure modes per method")
    assert ours["intersection"] == ours["semantic"] == "25.0 (4.6-69.9)" and ours["not upright"].startswith("0.0 ")
    assert ours["into the table"] == ours["intersection"] and ours["no arrangement"].startswith("0.0 ")
    assert papers[1] == {
        "model": "paper: StructDiffusion", "n": "-", "intersection": "6.4", "abnormal velocity": "17.6",
        "not upright": "4.5", "semantic": "3.7", "no arrangement": "-",
        "into the table": "-",
    }  # fmt: skip
    ours, *papers = table(found, "Failure modes per structure")
    assert (ours["structure"], ours["n"]) == ("line", "4") and len(papers) == 4
    (row,) = table(found, "Time")
    assert (row["mean"], row["planning"], row["everything"]) == ("2.00", "8", "12")
    assert {one.title for one in tables_of(found)} == {
        "Success per method and structure", "Success within k arrangements", "Failure modes per method",
        "Failure modes per structure", "Time",
    }  # fmt: skip


def test_guidance_by_weight():
    names = ("diffusion-tokens-unranked", "diffusion-tokens+guidance1", "diffusion-tokens+guidance8")
    found = report(*(evaluation(name, [1] * hits + ["semantic"] * (4 - hits)) for hits, name in enumerate(names, 1)))
    rows = table(found, "Classifier guidance")
    assert list(rows[0]) == ["task", "weight 0", "weight 1", "weight 8"]
    assert [rows[0][key].split()[0] for key in rows[0]] == ["line", "25.0", "50.0", "75.0"]
    assert {"task": "paper: tower", "weight 0": "72", "weight 1": "76", "weight 8": "73"} in rows


def test_language_input():
    found = report(evaluation("diffusion", [1, 1]), evaluation("diffusion-tokens", [1, "semantic"]))
    rows = table(found, "Language input of diffusion-tokens")
    assert [row["language"] for row in rows] == [
        "word tokens (diffusion-tokens)", "sentence (diffusion)", "paper: word tokens", "paper: sentence",
    ]  # fmt: skip
    assert [row["line"].split()[0] for row in rows] == ["50.0", "100.0", "72", "67"]


def test_ablations_are_compared_on_the_same_scenes():
    full = evaluation("diffusion-tokens", [1] * 8 + ["semantic"] * 2)
    variant = evaluation("diffusion-tokens-no-refinement", ["semantic"] * 7 + [1, 1, "semantic"])
    rows = table(report(full, variant, evaluation("geometric", [1])), "Ablations of diffusion-tokens")
    assert [(row["model"], row["changed"]) for row in rows] == [
        ("diffusion-tokens", "-"), ("diffusion-tokens-no-refinement", "refined: no"),
    ]  # fmt: skip
    assert (rows[1]["only variant"], rows[1]["only full"], rows[1]["p"]) == ("1", "7", "0.07")


@pytest.mark.parametrize("structure", ["circle", "table setting"])
def test_the_page_names_command_seed_and_number(structure):
    page = markdown_of(report(evaluation("geometric", [1, "semantic"], structure)))
    assert "```sh\nstructagent evaluate success --seed 7\n```" in page and "structagent 1.2" in page
    assert page.count(" Seed 7.") == len(tables_of(report(evaluation("geometric", [1], structure))))
    assert f"| model | n | {structure} | all |\n| --- | --- | --- | --- |\n| geometric | 2 |" in page
