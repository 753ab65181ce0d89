"""Nouns of recorded scenes are counted as named and as right."""

import io

import pytest

from agent.evaluation.nouns import measurement
from agent.evaluation.nouns.measurement import is_right, measure_nouns, print_nouns
from agent.perception.nouns.recognition import nouns_available


@pytest.mark.parametrize(
    ("word", "truth", "right"),
    [
        ("cup", "mug", True),
        ("mug", "cup", False),
        ("box", "cracker box", True),
        ("bottle", "milk carton", False),
        ("can", "tomato soup can", True),
        ("ball", "tennis ball", True),
    ],
)
def test_a_noun_is_right_if_an_instruction_with_it_means_the_object(word, truth, right):
    assert is_right(word, truth) is right


def test_rates_count_objects_by_confidence():
    rows = [
        {"truth": "mug", "nouns": {"mug": 0.9}},
        {"truth": "mug", "nouns": {"cup": 0.4, "mug": 0.35}},
        {"truth": "carton", "nouns": {"bottle": 0.8}},
        {"truth": "drill", "nouns": {}},
    ]
    rates = measurement._rates(rows, 0.7)
    assert (rates["named"]["count"], rates["named"]["n"]) == (3, 4)
    assert (rates["right"]["count"], rates["right"]["n"]) == (2, 3)
    assert measurement._rates(rows, 0.85)["right"]["rate"] == 1.0


@pytest.mark.skipif(not nouns_available(), reason="the weights (extra nouns) are not installed")
def test_scenes_are_recorded_and_measured():
    report = measure_nouns("validation", 1, 3, 1)
    assert report["command"] == "structagent evaluate nouns --objects validation --scenes 1 --seed 3"
    assert len(report["rows"]) >= 8 and all(set(row) == {"truth", "nouns"} for row in report["rows"])
    counts = [rates["named"]["count"] for rates in report["levels"].values()]
    assert counts == sorted(counts, reverse=True)  # the higher the confidence, the fewer are named
    results = io.StringIO()
    print_nouns(report, results)
    assert "0.7 (in use)" in results.getvalue() and report["command"] in results.getvalue()
