"""Make the pictures of the documents from the real tool: the chat in a pseudo-terminal, and a run built by the arm.

`python docs/make_pictures.py` writes `docs/images/chat.png`, `build.webp` and `goal.webp`. It needs the extra `test`
(pexpect, pyte) and takes about a minute.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import pexpect
import pyte
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
INSTRUCTION = "put the cups in a small circle on the left"
RUN_SEED = 2  # the scene of `make demo`: four cups
CHAT_SEED = 4
CONVERSATION = (INSTRUCTION, "bigger")

COLUMNS, ROWS = 80, 100
TIMEOUT = 300.0  # s, per reply of the chat
PROMPT = re.compile(r"(?:>|build it\? \[y/n\] >)\s*")

FONT_SIZE = 26  # px; the picture is shown at about half of its size
MARGIN = 24  # px
BACKGROUND, FOREGROUND = "#1b1e24", "#d8dbe2"
ANSI_COLORS = {
    "black": "#3b4048", "red": "#e06c75", "green": "#98c379", "brown": "#d9b25f", "blue": "#61afef",
    "magenta": "#c678dd", "cyan": "#56b6c2", "white": "#d8dbe2", "brightblack": "#7a818e", "brightred": "#ef7f88",
    "brightgreen": "#aad48b", "brightbrown": "#ecca7a", "brightblue": "#7cc0f7", "brightmagenta": "#d694ea",
    "brightcyan": "#72cdd8", "brightwhite": "#ffffff",
}  # fmt: skip
# Block characters as the filled parts of a cell: left, top, right, bottom as fractions.
BLOCKS = {
    "▀": [(0, 0, 1, 0.5)], "▄": [(0, 0.5, 1, 1)], "█": [(0, 0, 1, 1)], "▌": [(0, 0, 0.5, 1)], "▐": [(0.5, 0, 1, 1)],
    "▘": [(0, 0, 0.5, 0.5)], "▝": [(0.5, 0, 1, 0.5)], "▖": [(0, 0.5, 0.5, 1)], "▗": [(0.5, 0.5, 1, 1)],
    "▚": [(0, 0, 0.5, 0.5), (0.5, 0.5, 1, 1)], "▞": [(0.5, 0, 1, 0.5), (0, 0.5, 0.5, 1)],
    "▛": [(0, 0, 1, 0.5), (0, 0.5, 0.5, 1)], "▜": [(0, 0, 1, 0.5), (0.5, 0.5, 1, 1)],
    "▙": [(0, 0.5, 1, 1), (0, 0, 0.5, 0.5)], "▟": [(0, 0.5, 1, 1), (0.5, 0, 1, 0.5)],
}  # fmt: skip

Row = Sequence[pyte.screens.Char]


def main() -> None:
    """Write all pictures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        screenshot(chat_rows(Path(folder))).save(IMAGES / "chat.png", optimize=True)
        build_pictures(Path(folder) / "run")


def chat_rows(home: Path) -> list[Row]:
    """Hold the conversation in a pseudo-terminal and return its rows, from the instruction to the last proposal.

    Args:
        home: an empty folder for history, session and settings.
    """
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("STRUCTAGENT_", "NO_COLOR"))
    }
    environment |= {
        "TERM": "xterm-256color", "COLORTERM": "truecolor", "PROMPT_TOOLKIT_NO_CPR": "1", "PYTHONPATH": str(ROOT),
        "XDG_STATE_HOME": str(home), "XDG_CONFIG_HOME": str(home),
    }  # fmt: skip
    child = pexpect.spawn(
        sys.executable, ["-m", "agent", "chat", "--seed", str(CHAT_SEED), "--out", str(home / "chat")],
        dimensions=(ROWS, COLUMNS), env=environment, encoding="utf-8", timeout=TIMEOUT, cwd=str(home),
    )  # fmt: skip
    screen = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.Stream(screen)
    try:
        for line in CONVERSATION:
            _read_until_prompt(child, screen, stream)
            child.send(line)
            _read(child, stream, 1.0)
            child.send("\r")
        _read_until_prompt(child, screen, stream)
    finally:
        child.close(force=True)
    rows = [[screen.buffer[row][column] for column in range(COLUMNS)] for row in range(ROWS)]
    first = next(row for row, text in enumerate(screen.display) if text.startswith(f"> {INSTRUCTION}"))
    return rows[first : screen.cursor.y + 1]


def _read(child: pexpect.spawn, stream: pyte.Stream, seconds: float) -> bool:
    """Feed what the program writes within some seconds to the screen; whether there was anything."""
    try:
        stream.feed(child.read_nonblocking(65536, seconds))
    except (pexpect.TIMEOUT, pexpect.EOF):
        return False
    return True


def _read_until_prompt(child: pexpect.spawn, screen: pyte.Screen, stream: pyte.Stream) -> None:
    deadline = time.monotonic() + TIMEOUT
    while True:
        quiet = not _read(child, stream, 0.5)
        if quiet and PROMPT.fullmatch(screen.display[screen.cursor.y].rstrip()):
            return
        if time.monotonic() > deadline or not child.isalive():
            raise RuntimeError(
                "the chat showed no prompt; the end of its screen:\n" + "\n".join(screen.display).rstrip()
            )


def screenshot(rows: Sequence[Row]) -> Image.Image:
    """Draw rows of terminal cells as a picture.

    Args:
        rows: cells with their characters, colours and attributes.
    """
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    regular, bold = (
        ImageFont.truetype(fonts / name, FONT_SIZE) for name in ("DejaVuSansMono.ttf", "DejaVuSansMono-Bold.ttf")
    )
    width, height = round(regular.getlength("M")), round(FONT_SIZE * 1.25)
    image = Image.new("RGB", (width * COLUMNS + 2 * MARGIN, height * len(rows) + 2 * MARGIN), BACKGROUND)
    draw = ImageDraw.Draw(image)
    for y, row in enumerate(rows):
        for x, cell in enumerate(row):
            left, top = MARGIN + x * width, MARGIN + y * height
            front, back = _color(cell.fg, FOREGROUND), _color(cell.bg, BACKGROUND)
            if cell.reverse:
                front, back = back, front
            if back != BACKGROUND:
                draw.rectangle((left, top, left + width - 1, top + height - 1), fill=back)
            for part in BLOCKS.get(cell.data, ()):
                edges = (
                    left + part[0] * width,
                    top + part[1] * height,
                    left + part[2] * width - 1,
                    top + part[3] * height - 1,
                )
                draw.rectangle(edges, fill=front)
            if cell.data not in BLOCKS and cell.data.strip():
                draw.text((left, top), cell.data, font=bold if cell.bold else regular, fill=front)
    return image.quantize(128)


def _color(name: str, default: str) -> str:
    if name == "default":
        return default
    return ANSI_COLORS.get(name) or f"#{name}"


def build_pictures(out: Path) -> None:
    """Run the instruction and keep the film of the build and the goal drawn over the camera's picture.

    Args:
        out: the folder for the report of the run.
    """
    command = [sys.executable, "-m", "agent", "run", INSTRUCTION, "--seed", str(RUN_SEED), "--out", str(out)]
    subprocess.run(command, cwd=ROOT, check=True)
    shutil.copyfile(out / "film.webp", IMAGES / "build.webp")
    shutil.copyfile(out / "goal-overlay.webp", IMAGES / "goal.webp")


if __name__ == "__main__":
    main()
