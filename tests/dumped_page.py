"""What a page becomes in a real browser without a window; tests skip where none is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")  # without a graphics card
_WAIT = 120  # s


def installed_browser() -> str:
    """Return the path of a browser; skip the test where there is none."""
    program = next(filter(None, map(shutil.which, _NAMES)), None)
    if program is None:
        pytest.skip(f"no browser is installed; one of {', '.join(_NAMES)} is needed")
    return program


def dumped_page(page: Path, *, webgl: bool = True, picture: Path | None = None) -> str:
    """Open a page from its file, run its scripts, and return its document as HTML.

    Args:
        page: the file.
        webgl: whether the browser has WebGL.
        picture: a PNG file to write of what is seen, 1200 by 900 pixels; then the HTML is empty.
    """
    program = installed_browser()
    what = ("--dump-dom",) if picture is None else (f"--screenshot={picture}",)
    command = [
        program, "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run",
        "--window-size=1200,900", "--virtual-time-budget=5000", f"--user-data-dir={page.parent / 'profile'}",
        *(_WEBGL if webgl else ("--disable-gpu", "--disable-3d-apis")), *what, page.as_uri(),
    ]  # fmt: skip
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_WAIT, check=False)
    except subprocess.TimeoutExpired:
        pytest.skip("a browser is installed, but it is not done in time here")
    if done.returncode != 0:
        pytest.skip("a browser is installed, but it does not start here")
    return done.stdout
