"""A tower is one chain of objects, each over the one below."""

from dataclasses import replace

from grounding.spec import StructureSpec
from tests.structdiffusion.structures.handmade import failures, moved, tower


def test_a_tower_and_how_it_is_broken():
    stack = tower()
    spec = StructureSpec("tower")
    assert failures(stack, spec) == []
    assert failures([stack[2], stack[0], stack[1]], spec) != []  # carriers are indices, which have changed
    chain = ["objects that rest on the next one below only"]
    assert failures([*stack[:2], replace(stack[2], rests_on=(0, 1))], spec) == chain
    assert failures([*stack[:2], replace(stack[2], rests_on=())], spec) == chain
    assert failures([replace(stack[0], rests_on=(2,)), *stack[1:]], spec) == chain
    over = ["objects whose centroid lies over the one below"]
    assert failures([*stack[:2], moved(stack[2], dy=0.06)], spec) == over
    assert failures(stack[:1], spec) == ["objects in the tower"]
