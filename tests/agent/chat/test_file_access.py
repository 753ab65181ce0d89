"""Which files the commands of a chat may name where other programs can drive it."""

import io

import pytest
from rich.console import Console

from agent.chat.file_access import FileAccess
from agent.chat.input import PlainLines
from agent.chat.repl import Chat
from agent.chat.view import ChatScreen
from agent.errors import UsageError


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """A session's folder, a working folder, a home, and a folder that none of these is."""
    for name in ("out", "desk", "home", "elsewhere"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "desk")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return tmp_path


@pytest.fixture
def access(folders):
    return FileAccess((folders / "out", folders / "desk"))


def test_files_inside_are_taken(folders, access):
    (folders / "desk" / "deep").mkdir()
    (folders / "out" / "link.yaml").symlink_to(folders / "desk" / "real.yaml")
    for text in ("new.yaml", "deep/../new.yaml", "./new.yaml", str(folders / "desk" / "new.yaml"), "../desk/new.yaml"):
        assert access.path("/save", text) == folders / "desk" / "new.yaml"
    assert access.path("/save", "../out/a b.yaml") == folders / "out" / "a b.yaml"
    assert access.path("/save", "../out/link.yaml") == folders / "desk" / "real.yaml"
    assert access.path("/load", "~/x.yaml".replace("~", "~x")) == folders / "desk" / "~x" / "x.yaml"


@pytest.mark.parametrize(
    "text",
    [
        "/etc/passwd", "/etc/x.yaml", "..", "../x.yaml", "../elsewhere/x.yaml", "~/x.yaml", "~/../elsewhere/x.yaml",
        "deep/../../elsewhere/x.yaml", "link/x.yaml", "dangling.yaml", "file.yaml", "../out/../elsewhere/x.yaml",
        "../desk-2/x.yaml", "../out2.yaml", "circle/x.yaml", "nul\x00.yaml", "/proc/self/cwd/../elsewhere/x.yaml",
        "//etc/x",
    ],
)  # fmt: skip
def test_files_outside_are_refused(folders, access, text):
    desk, elsewhere = folders / "desk", folders / "elsewhere"
    (elsewhere / "x.yaml").write_text("version: 1")
    (desk / "link").symlink_to(elsewhere)
    (desk / "dangling.yaml").symlink_to(elsewhere / "none.yaml")
    (desk / "file.yaml").symlink_to(elsewhere / "x.yaml")
    (desk / "circle").symlink_to(desk / "circle")
    with pytest.raises(UsageError, match="^/save (from a page takes only files in|cannot take)") as refused:
        access.path("/save", text)
    assert "\n" not in str(refused.value)


def test_in_a_terminal_any_file_is_taken(folders):
    assert str(FileAccess().path("/save", "../elsewhere/x.yaml")) == "../elsewhere/x.yaml"
    assert FileAccess().path("/save", "~/x.yaml") == folders / "home" / "x.yaml"


def talked(conversation, folders, access, *lines: str) -> str:
    """Return what a chat shows for some lines."""
    console = Console(file=io.StringIO(), width=400)
    source = PlainLines(io.StringIO("\n".join(lines) + "\n"), lambda text: None)
    conversation.listeners = []
    Chat(conversation, ChatScreen(console), source, folders / "out" / "session.jsonl", access=access).run()
    return console.file.getvalue()


def test_every_command_with_a_file_stays_inside(conversation, folders, access):
    shown = talked(
        conversation, folders, access, "/save ../elsewhere/a.yaml", "/sav ../elsewhere/a.yaml", "/report ~/a.html",
        f"/load {folders}/elsewhere/a.yaml", "/save ../out/a.yaml", "/load ../out/a.yaml", "/save b.yaml",
    )  # fmt: skip
    assert shown.count("`structagent serve --any-file` takes any") == 4
    assert (
        shown.count("saved ") == 2 and (folders / "out" / "a.yaml").exists() and (folders / "desk" / "b.yaml").exists()
    )
    assert not list((folders / "elsewhere").iterdir()) and not list((folders / "home").iterdir())
    assert "saved ../elsewhere/a.yaml" in talked(conversation, folders, FileAccess(), "/save ../elsewhere/a.yaml")
