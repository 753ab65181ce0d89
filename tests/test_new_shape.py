"""A thirteenth shape, added in a copy as docs/development.md says: it is read, also in goals, and planned,
without training.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORDS = """\
name = "zigzag"
number = 13
slots = ["size", "x_position", "y_position"]
keys = ["gap"]
least = 3

[words]
nouns = ["zigzag", "sawtooth"]
never_objects = ["zigzag", "zigzags", "sawtooth"]

[grammar]
nouns = ["zigzag", "zigzag", "sawtooth", "zigzag"]
actions = ["zigzag the {objects}{size}{where}"]

[phrases]
noun = ["zigzag", "sawtooth"]
action = ["arrange {o} in a zigzag"]
"""
STRUCTURE = '''\
"""The zigzag: objects in turn before and behind a line."""

import numpy as np

from structdiffusion.structures.checks import Check, count_check, on_table_check, position_checks, size_checks
from structdiffusion.structures.keys import NO_KEYS
from structdiffusion.structures.spread import SpreadStructure, draft_on_places, spread_ratio


class Zigzag(SpreadStructure):
    """Three or more objects."""

    name = "zigzag"
    least = 3
    usual_counts = (3, 6)

    def draft(self, items, spec, heading, rng, keys=NO_KEYS):
        """Draw a zigzag along the table's y axis."""
        self.require_enough(items)
        places = np.array([(float(k % 2), float(k)) for k in range(len(items))])
        return draft_on_places(items, places - places.mean(axis=0), [0.0] * len(items), spec, 0.0, rng)

    def check(self, bodies, spec, table):
        """Check that every second object is farther than its neighbours, the size, the place, and that all stand."""
        checks = [count_check(bodies, self.name, self.least)]
        if len(bodies) < self.least:
            return checks
        x = np.array([body.centroid[0] for body in sorted(bodies, key=lambda body: body.centroid[1])])
        turns = np.diff(np.sign(np.diff(x)))
        zigzag = bool((np.abs(turns) == 2).all())
        checks += [Check("turns", zigzag, float(len(turns)), "every object"), on_table_check(bodies)]
        checks += size_checks(spread_ratio(bodies), spec)
        return checks + position_checks(bodies, self.centre(bodies), spec, table)
'''
SAID = """\
import json

from tests.grounding.readers import reader

NAMES = ["cup", "cup", "cup", "can", "can", "bowl"]
interpreter = reader()
plain = interpreter.interpret("put the cups in a zigzag on the left", NAMES)
several = interpreter.interpret("put the cups in a sawtooth on the left and stack the cans on the right", NAMES)
moved = interpreter.interpret("put the zigzag on the right instead", NAMES, plain.goal)
known = interpreter.interpret("make a circle of the cups", NAMES)
print(json.dumps([[one.status, one.message, one.goal.to_dict()] for one in (plain, several, moved, known)]))
"""
PLANNED = """\
import structagent
from tests.agent.public.conftest import PLACES, box_cloud

goal = {"parts": [{"kind": "structure", "shape": "zigzag", "x_position": "left", "objects": [0, 1, 2]}]}
found = structagent.propose([box_cloud(x, y) for x, y in PLACES[:4]], goal, model="geometric", count=4)
print(found.status, found.moved)
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Path:
    """The packages with one more shape; the weights of the networks are those that are shipped."""
    folder = tmp_path_factory.mktemp("copy")
    for package in ("agent", "grounding", "structdiffusion", "prompts"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("weights", "__pycache__"))
    for weights in (
        each for package in ("agent", "grounding", "structdiffusion") for each in (ROOT / package).rglob("weights")
    ):
        (folder / weights.relative_to(ROOT)).symlink_to(weights)
    (folder / "tests").symlink_to(ROOT / "tests")
    (folder / "grounding/structures/zigzag.toml").write_text(WORDS)
    (folder / "structdiffusion/structures/zigzag.py").write_text(STRUCTURE)
    registry = folder / "structdiffusion/structures/__init__.py"
    text = registry.read_text().replace("Cross(), Pyramid(),", "Cross(), Pyramid(), Zigzag(),")
    registry.write_text(
        text.replace("# In the order of", "from structdiffusion.structures.zigzag import Zigzag\n\n# In the order of")
    )
    return folder


def answer(copy: Path, script: str) -> str:
    path = os.pathsep.join((str(copy), str(copy / "agent" / "public")))
    found = subprocess.run(
        [sys.executable, "-c", script],
        cwd=copy,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_it_is_read_in_instructions_goals_and_corrections(copy):
    plain, several, moved, known = json.loads(answer(copy, SAID))
    shapes = [(part["shape"], part["objects"], part["x_position"]) for part in plain[2]["parts"]]
    assert (plain[0], shapes) == ("ok", [("zigzag", [0, 1, 2], "left")]), plain
    shapes = [(part["shape"], part["objects"], part["x_position"]) for part in several[2]["parts"]]
    assert (several[0], shapes) == ("ok", [("zigzag", [0, 1, 2], "left"), ("tower", [3, 4], "right")]), several
    shapes = [(part["shape"], part["objects"], part["x_position"]) for part in moved[2]["parts"]]
    assert (moved[0], shapes) == ("ok", [("zigzag", [0, 1, 2], "right")]), moved
    assert (known[0], known[2]["parts"][0]["shape"]) == ("ok", "circle"), known


def test_the_geometric_planner_builds_it(copy):
    assert answer(copy, PLANNED).split()[0] == "ok"
