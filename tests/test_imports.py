"""Imports run downward only: every package may import those below it, and no modules import each other in a circle."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("agent", "grounding", "structdiffusion")
# From the bottom up. What stands in one row does not import each other.
LAYERS = (
    ("agent", "grounding", "structdiffusion"),  # docstring and version of each package
    (
        "grounding.atomic_files",
        "grounding.instruction_files",
        "grounding.linear_algebra",
        "grounding.packed_weights",
        "grounding.untrusted_files",
        "grounding.user_folder",
    ),
    ("grounding.figures",),
    ("grounding.structure_words",),
    ("agent.errors", "agent.event_base", "grounding.spec", "structdiffusion.geometry", "structdiffusion.limits"),
    (
        "structdiffusion.evaluation_protocol",
        "structdiffusion.rotations",
        "structdiffusion.tableware",
        "structdiffusion.temporary_folders",
    ),
    ("grounding.goals", "grounding.parse_result", "structdiffusion.observation", "structdiffusion.word_tokens"),
    ("grounding.corpus", "grounding.viewpoint", "structdiffusion.footprints"),
    ("structdiffusion.figures",),
    ("grounding.benchmark", "grounding.parsers", "structdiffusion.objects", "structdiffusion.structures"),
    ("grounding.resolve", "structdiffusion.layouts", "structdiffusion.simulation"),
    ("grounding.edits", "grounding.foreign_languages", "grounding.goal_benchmark", "structdiffusion.relations"),
    ("grounding.goal_network",),
    ("grounding.verify",),
    ("grounding.propose",),
    ("grounding.decide", "grounding.language_model"),
    ("grounding.candidates", "grounding.sentences"),
    ("grounding.interpretation",),
    ("grounding.verdicts",),
    (
        "grounding.interpreter",
        "structdiffusion.parallel_imports",
        "structdiffusion.protocol",
        "structdiffusion.worker_process",
    ),
    ("grounding.dialogue", "grounding.training", "structdiffusion.parallel"),
    ("structdiffusion.completion", "structdiffusion.data"),
    ("structdiffusion.fitting_shapes", "structdiffusion.models"),
    ("structdiffusion.postprocessing", "structdiffusion.training"),
    ("structdiffusion.composition",),
    ("structdiffusion.planners",),
    ("structdiffusion.benchmark", "agent.events"),
    ("agent.arm", "agent.rendering", "agent.segmentation_network", "agent.synthetic_tables"),
    ("agent.model_cards",),
    ("agent.runtime",),
    ("agent.diagnostics", "agent.recordings"),
    ("agent.perception", "agent.robots"),
    ("agent.scenes", "agent.training"),
    ("agent.pipeline", "agent.reporting"),
    ("agent.figures",),
    ("agent.environment", "agent.export"),
    ("agent.batch", "agent.chat"),
    ("agent.evaluation",),
    ("agent.live_view", "agent.mcp"),
    ("agent.cli",),
    ("agent.__main__",),
    # The public interface: agent/public/structagent.
    ("structagent.errors",),
    ("structagent.arguments", "structagent.engine", "structagent.gym", "structagent.notebooks"),
    ("structagent.clouds",),
    ("structagent.scenes",),
    ("structagent.instructions",),
    ("structagent.proposals", "structagent.sources"),
    ("structagent.evaluations", "structagent.runs"),
    ("structagent",),
)
LEVEL = {package: level for level, row in enumerate(LAYERS) for package in row}


def module_name(path: Path) -> str:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    return name.removeprefix("agent.public.")


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def imported_by(module: str, source: str) -> set[str]:
    """Every module of ours that `source` imports, at the top, in functions and under TYPE_CHECKING alike."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} has a relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return {name for name in found if name in MODULES and name != module and not _is_own_package(name, module)}


def _is_own_package(name: str, module: str) -> bool:
    """Whether `name` is a package that `module` lies in: importing a sibling names it too."""
    return module.startswith(f"{name}.")


def package_of(module: str) -> str:
    return ".".join(module.split(".")[:2])


def upward(imports: dict[str, set[str]]) -> list[str]:
    """The imports that do not run downward, from one package to another."""
    return [
        f"{module} imports {name}"
        for module, names in imports.items()
        for name in sorted(names)
        if package_of(name) != package_of(module) and LEVEL[package_of(name)] >= LEVEL[package_of(module)]
    ]


def circles(imports: dict[str, set[str]]) -> list[str]:
    """The modules that remain when those that import nothing that remains are taken away, again and again."""
    left = {module: set(names) for module, names in imports.items()}
    while free := {module for module, names in left.items() if not names & left.keys()}:
        left = {module: names for module, names in left.items() if module not in free}
    return sorted(left)


@pytest.fixture(scope="module")
def imports() -> dict[str, set[str]]:
    return {module: imported_by(module, path.read_text(encoding="utf-8")) for module, path in MODULES.items()}


def test_every_package_has_its_layer():
    assert {package_of(module) for module in MODULES} == LEVEL.keys()


def test_no_import_runs_upward(imports):
    assert upward(imports) == []


def test_no_modules_import_each_other_in_a_circle(imports):
    assert circles(imports) == []


def test_upward_imports_and_circles_are_found():
    one = imported_by("grounding.spec", "def late():\n    from agent.cli import app\n")
    assert upward({"grounding.spec": one}) == [f"grounding.spec imports agent.cli{end}" for end in ("", ".app")]
    checking = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import grounding.benchmark\n"
    assert imported_by("grounding.spec", checking) == {"grounding.benchmark"}
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}) == ["a", "b", "c"]
