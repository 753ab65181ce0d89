"""A real browser without a window, driven over its debugging protocol; tests skip where none is installed."""

from __future__ import annotations

import base64
import io
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
# Software rendering gives WebGL on machines without a graphics card.
_OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--remote-debugging-port=0", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--js-flags=--expose-gc",
)  # fmt: skip
_START = 30.0  # s
_ANSWER = 60.0  # s


class Page:
    """A tab of the browser.

    Attributes:
        errors: the messages of scripts that failed and of what the page's rules blocked.
    """

    def __init__(self, address: str) -> None:
        connect = pytest.importorskip("websockets.sync.client", reason="needs the extra `view`").connect

        self._open = ExitStack()
        self._socket = self._open.enter_context(connect(address, max_size=None, compression=None))
        self._calls = 0
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        self._calls += 1
        self._socket.send(json.dumps({"id": self._calls, "method": method, "params": parameters}))
        end = time.monotonic() + _ANSWER
        while True:
            answer = json.loads(self._socket.recv(timeout=max(0.1, end - time.monotonic())))
            if answer.get("id") == self._calls:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        if event["method"] == "Runtime.exceptionThrown":
            details = event["params"]["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] == "error":
            self.errors.append(event["params"]["entry"]["text"])

    def size(self, width: int, height: int, phone: bool = False) -> None:
        """Set the size of the window in CSS pixels; `phone` for touch and two pixels for each of them."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone,
        )  # fmt: skip

    def without_webgl(self) -> None:
        """Give the pages that are opened from now on no WebGL."""
        source = (
            "const context = HTMLCanvasElement.prototype.getContext;"
            "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
            " return kind === '2d' ? context.call(this, kind, ...rest) : null; };"
        )
        self.call("Page.addScriptToEvaluateOnNewDocument", source=source)

    def open(self, address: str) -> None:
        """Open an address in front of other pages, and wait until it is loaded."""
        self.call("Page.bringToFront")
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'")

    def value(self, expression: str) -> Any:
        """Return the JSON value of an expression of JavaScript."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, expression: str, seconds: float = _ANSWER) -> Any:
        """Wait until an expression is true; return its value."""
        end = time.monotonic() + seconds
        while not (value := self.value(expression)):
            assert time.monotonic() < end, f"never true within {seconds} s: {expression}"
            time.sleep(0.05)
        return value

    def press(self, selector: str) -> None:
        """Press the mouse on the middle of an element, as a user does: what lies over it gets the press instead."""
        found = f"document.querySelector({json.dumps(selector)})"
        self.wait(f"{found} && !{found}.disabled && {found}.getClientRects().length > 0")
        self.value(f"{found}.scrollIntoView({{block: 'nearest'}})")
        place = self.value(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({found}.getBoundingClientRect())")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], button="left", clickCount=1)

    def drag(self, start: tuple[float, float], end: tuple[float, float], shift: bool = False) -> None:
        """Press the left button at a place of the page, px, move the pointer in steps, and let go."""
        steps = [(start[0] + (end[0] - start[0]) * k / 8, start[1] + (end[1] - start[1]) * k / 8) for k in range(9)]
        modifiers = 8 if shift else 0
        kinds = ["mousePressed", *["mouseMoved"] * 8, "mouseReleased"]
        for kind, (x, y) in zip(kinds, [start, *steps[1:], end], strict=True):
            self.call(
                "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(kind != "mouseReleased"),
                clickCount=1, modifiers=modifiers,
            )  # fmt: skip

    def type(self, selector: str, text: str) -> None:
        """Type text into a field, and press Enter."""
        self.press(selector)
        self.call("Input.insertText", text=text)
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", windowsVirtualKeyCode=13, text="\r"
            )

    def picture(self, path: Path | None = None) -> np.ndarray:
        """Return what the page shows (H, W, 3) uint8, and write it to a PNG file if a path is given."""
        content = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            path.write_bytes(content)
        return np.asarray(Image.open(io.BytesIO(content)).convert("RGB"))

    def close(self) -> None:
        """End the connection."""
        self._open.close()


class Browser:
    """A running browser, which opens pages."""

    def __init__(self, port: int) -> None:
        self._port = port

    def page(self) -> Page:
        """Open an empty page."""
        request = urllib.request.Request(f"http://127.0.0.1:{self._port}/json/new?about:blank", method="PUT")
        with urllib.request.urlopen(request, timeout=_START) as answer:
            return Page(json.load(answer)["webSocketDebuggerUrl"])


def installed_browser() -> str:
    """Return the path of a browser; skip the test where there is none."""
    program = next(filter(None, map(shutil.which, _NAMES)), None)
    if program is None:
        pytest.skip(f"no browser is installed; one of {', '.join(_NAMES)} is needed")
    return program


@contextmanager
def running_browser(folder: Path) -> Iterator[Browser]:
    """Run a browser with a profile of its own in `folder`; skip the test where there is none."""
    process = subprocess.Popen(
        [installed_browser(), *_OPTIONS, f"--user-data-dir={folder}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield Browser(_port_of(folder, process))
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=10)
        process.kill()


def _port_of(folder: Path, process: subprocess.Popen[bytes]) -> int:
    told, end = folder / "DevToolsActivePort", time.monotonic() + _START
    while not (told.is_file() and told.read_text().strip()):
        if process.poll() is not None or time.monotonic() > end:
            pytest.skip("a browser is installed, but it does not start here")
        time.sleep(0.05)
    return int(told.read_text().split()[0])
