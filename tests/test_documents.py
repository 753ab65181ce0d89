"""The documents are true to the tool: their commands parse, their options exist, their links lead somewhere."""

from __future__ import annotations

import functools
import importlib.util
import re
import shlex
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
# The documents that tell how to use the tool, and all others whose links are checked.
PAGES_OF_DATA = [ROOT / "agent/recordings/example/README.md", ROOT / "grounding/benchmark_data/README.md"]
GUIDES = [README, *sorted((ROOT / "docs").glob("*.md")), *PAGES_OF_DATA]
DOCUMENTS = [*GUIDES, *(ROOT / name for name in ("SECURITY.md", "CHANGELOG.md", "THIRD_PARTY.md"))]

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
ALTERNATIVES = re.compile(r"[\w-]+(?:\|[\w-]+)+")
PLACEHOLDERS = {"TEXT": "make a line", "TEXT...": "make a line", "MODEL": "diffusion", "NAME": "diffusion"}
FOLDERS = ("DIR", "data/train", "meshes", "runs", "runs/diffusion")


def without_fences(text: str) -> str:
    return FENCED.sub("", text)


def inline_code(text: str) -> list[str]:
    """The pieces of inline code, each on one line, `a\\|b` of tables as `a|b`."""
    return [" ".join(code.split()).replace("\\|", "|") for code in INLINE.findall(without_fences(text))]


class Command(NamedTuple):
    """A structagent command of a document.

    Attributes:
        words: without the program's name.
        complete: whether it is there to be typed; in a sentence, "`structagent run`" only names a command.
    """

    words: list[str]
    complete: bool


def commands_of(text: str) -> list[Command]:
    """Every structagent command of a document; alternatives one by one."""
    lines = [
        line for kind, block in FENCED.findall(text) if kind == "sh" for line in block.replace("\\\n", " ").splitlines()
    ]
    found = []
    for line, complete in [(line, True) for line in lines] + [(code, False) for code in inline_code(text)]:
        # The words of the shell that come after the command are not its own.
        words = shlex.split(re.split(r"\s[<>|]\s", line.removeprefix("source <(").rstrip(")"))[0], comments=True)
        if words[:1] == ["structagent"]:
            found += [Command(variant, complete) for variant in expanded(words[1:])]
    return found


def expanded(words: list[str]) -> list[list[str]]:
    """The words with each alternative of "a|b" in its place."""
    for place, word in enumerate(words):
        if ALTERNATIVES.fullmatch(word):
            return [
                variant for one in word.split("|") for variant in expanded([*words[:place], one, *words[place + 1 :]])
            ]
    return [words]


def files_named(words: list[str]) -> list[str]:
    """What in a command may be the name of an existing file or folder."""
    return [word for word in words if re.fullmatch(r"[\w./-]+", word) and not word.startswith(("-", "/", "."))]


def parse(words: list[str], complete: bool) -> None:
    """Parse a command as the tool does, without executing it.

    Args:
        words: the command, without the program's name.
        complete: arguments may be missing only where this is false and there are none at all.

    Raises:
        click's usage errors, for a command, option or value that is not legal.
    """
    command, arguments = _structagent(), list(words)
    context = command.make_context("structagent", [], resilient_parsing=True)
    while hasattr(command, "resolve_command") and arguments and not arguments[0].startswith("-"):
        asked = arguments[0]
        name, command, arguments = command.resolve_command(context, arguments)
        if command is None:
            raise LookupError(f"there is no command {asked!r}")
        named_only = hasattr(command, "resolve_command") or not (complete or arguments)
        context = command.make_context(
            name, [] if named_only else list(arguments), parent=context, resilient_parsing=named_only
        )
    if arguments and hasattr(command, "resolve_command"):
        command.make_context(context.info_name, arguments, parent=context.parent)


@functools.cache
def _structagent() -> Any:
    """The tree of all commands, made once: it takes a tenth of a second, and there are hundreds of commands."""
    from agent.cli.app import app

    return typer.main.get_command(app)


def make_files(folder: Path, words: list[str]) -> None:
    """Make the files and folders that a command names, empty, in a folder."""
    for name in files_named(words):
        path = folder / name
        if name in FOLDERS:
            path.mkdir(parents=True, exist_ok=True)
        elif "." in path.name or name == "FILE":
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()


def check_command(folder: Path, command: Command) -> str | None:
    """What is wrong with a command, or `None`; the files that it names are made in `folder`."""
    words = [PLACEHOLDERS.get(word, word) for word in command.words]
    make_files(folder, words)
    try:
        parse(words, command.complete)
    except Exception as error:  # of whichever click typer comes with, and of the tool's own checks
        if getattr(error, "exit_code", None) == 0:  # --help
            return None
        return f"structagent {shlex.join(words)}: {getattr(error, 'message', '') or error or type(error).__name__}"
    return None


@pytest.mark.parametrize("path", GUIDES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_command_parses(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wrong = [check_command(tmp_path, command) for command in commands_of(path.read_text(encoding="utf-8"))]
    assert not [one for one in wrong if one]


def test_the_documents_have_commands():
    assert len(commands_of(README.read_text(encoding="utf-8"))) > 30
    assert sum(len(commands_of(path.read_text(encoding="utf-8"))) for path in GUIDES) > 100


@pytest.mark.parametrize(
    "text",
    [
        "```sh\nstructagent biuld now\n```",
        "```sh\nstructagent run 'a line' --sed 3\n```",
        "```sh\nstructagent run 'a line' --seed three\n```",
        "```sh\nstructagent run\\\n  'a line' \\\n  --no-exec  # continued\n```",
        "`structagent scene new|shwo`",
        "a line break in `structagent evaluate success\n--scene 3`",
        "`structagent run` is fine, `structagent run TEXT TEXT` is not",
        "```sh\nstructagent run --seed 3\n```",
        "```sh\nstructagent generate\n```",
    ],
)
def test_a_wrong_command_is_found(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert any(check_command(tmp_path, command) for command in commands_of(text))


@pytest.mark.parametrize("path", GUIDES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_option_exists(path):
    named = {
        option
        for code in inline_code(path.read_text(encoding="utf-8"))
        if not code.startswith(("python ", "pip ", "make "))
        for option in re.findall(r"(?<![\w-])--[a-z][\w-]*", code)
    }
    assert named <= every_option(_structagent()) | {"--help"}


def every_option(command: Any) -> set[str]:
    """The long options of a command and of those in it."""
    own = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    return own.union(*(every_option(inner) for inner in getattr(command, "commands", {}).values()))


@pytest.mark.parametrize("path", GUIDES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_module_and_target_exists(path):
    text = path.read_text(encoding="utf-8")
    modules = set(re.findall(r"python -m ([\w.]+)", text)) - {"pip"}
    assert not {name for name in modules if not module_exists(name)}
    targets = set(re.findall(r"^make (\w+)", "\n".join(block for _, block in FENCED.findall(text)), re.MULTILINE))
    assert targets <= set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))


def module_exists(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:  # its package is none
        return False


def anchors(text: str) -> set[str]:
    """The anchors that GitHub gives to the headings of a document."""
    found: set[str] = set()
    for heading in re.findall(r"^#{1,6} (.+)$", without_fences(text), re.MULTILINE):
        words = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        number = sum(
            anchor == words or re.fullmatch(rf"{re.escape(words)}-\d+", anchor) is not None for anchor in found
        )
        found.add(f"{words}-{number}" if number else words)
    return found


def broken_links(path: Path) -> list[str]:
    """The relative links of a document that lead to no file, or to no heading."""
    broken = []
    for link in (one or other for one, other in LINK.findall(without_fences(path.read_text(encoding="utf-8")))):
        if re.match(r"[a-z]+:", link):
            continue
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        if not target.exists() or not target.is_relative_to(ROOT if path.is_relative_to(ROOT) else path.parent):
            broken.append(f"{path.name}: {link} leads to no file")
        elif anchor and anchor not in anchors(target.read_text(encoding="utf-8")):
            broken.append(f"{path.name}: {link} leads to no heading")
    return broken


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_leads_somewhere(path):
    assert not broken_links(path)


def test_a_broken_link_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One, two\n[a](page.md#one-two) [b](#one) [c](none.md) ![d](d.png) [e](https://example.org)")
    assert [line.split()[1] for line in broken_links(page)] == ["#one", "none.md", "d.png"]


def test_readme_is_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 150


def test_pictures_are_small():
    assert sum(path.stat().st_size for path in (ROOT / "docs" / "images").iterdir()) < 1.5e6


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_protocol_has_one_name(path):
    assert not re.findall(r"\bthe contract\b|\bconventions\b", path.read_text(encoding="utf-8"), re.IGNORECASE)
