"""Build the HTML elements of every section of the page, and escape the text given to them."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from agent.rendering.animation import still_frames
from agent.rendering.image_files import FILM_SPEED
from agent.rendering.text import duration


def data_address(content: bytes) -> str:
    """Return the bytes of a WebP file as the address of a picture."""
    return f"data:image/webp;base64,{base64.b64encode(content).decode('ascii')}"


def figure(content: bytes, caption: str) -> str:
    """Show a picture (the bytes of a WebP file) with its caption."""
    text = escape(caption)
    return f'<figure><img alt="{text}" src="{data_address(content)}"><figcaption>{text}</figcaption></figure>'


def film(content: bytes, caption: str, interval: float) -> str:
    """Show a film (the bytes of an animated WebP file) with its controls and its caption.

    Without scripts the last picture is shown. A film whose frames are not complete pictures plays without controls.

    Args:
        content: the film.
        caption: the caption.
        interval: seconds of the arm's time between two pictures.
    """
    stills = still_frames(content)
    if stills is None:
        return figure(content, caption)
    text = escape(caption)
    data = json.dumps([base64.b64encode(still).decode("ascii") for still in stills])
    controls = (
        '<div class="controls" hidden><button type="button" aria-label="play">▶</button>'
        '<input type="range" min="0" value="0" aria-label="place in the film"><output></output></div>'
    )
    return (
        f'<figure class="film" data-interval="{interval:.3f}" data-speed="{FILM_SPEED:g}">'
        f'<img alt="{text}" src="{data_address(stills[-1])}">{controls}'
        f'<script type="application/json">{data}</script><figcaption>{text}</figcaption></figure>'
    )


def table_view(model: Mapping[str, Any]) -> str:
    """Show the table in 3D (`agent.reporting.table_model`), as a section that a script unveils where there is WebGL."""
    names = [view["name"] for view in model["views"]]
    buttons = "".join(f'<button type="button" value="{escape(name)}">{escape(name)}</button>' for name in names)
    robot = "" if model["robot"] is None or model["film"] else " The robot is the dark block."
    # A name may be "</script>".
    data = json.dumps(model, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        '<section hidden>\n<h3>The table in 3D</h3>\n<figure class="table-view">'
        '<canvas tabindex="0" role="img" aria-label="the table in 3D; the arrow keys turn it, + and - move it">'
        f'</canvas><div class="controls"><span role="group" aria-label="what is shown">{buttons}</span>'
        '<button type="button" class="play" aria-label="play" hidden>▶</button>'
        '<input type="range" min="0" value="0" aria-label="candidate or step"><output></output></div>'
        f'<script type="application/json">{data}</script>'
        f"<figcaption>Drag to turn the view. Click it, then zoom with the wheel or with + and -.{robot}"
        "</figcaption></figure>\n</section>"
    )


def album(figures: Sequence[str | None], kind: str = "pictures") -> str:
    """Place figures next to each other; return nothing if there are none."""
    there = [each for each in figures if each]
    return f'<div class="{kind}">{"".join(there)}</div>' if there else ""


def section(title: str, content: str, seconds: float | None = None) -> str:
    """Make a section; `content` is HTML, `seconds` the duration of the step."""
    note = f' <span class="soft">{duration(seconds)}</span>' if seconds is not None else ""
    return f"<section>\n<h3>{escape(title)}{note}</h3>\n{content}\n</section>"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], chosen: int | None = None) -> str:
    """Make a table; the cells are HTML, row `chosen` is marked."""
    lines = "".join(
        ('<tr class="chosen">' if index == chosen else "<tr>") + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>"
        for index, row in enumerate(rows)
    )
    titles = "".join(f'<th scope="col">{escape(title)}</th>' for title in head)
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{lines}</tbody></table></div>'


def bar(share: float) -> str:
    """Draw a bar that is filled to a share, in [0, 1]."""
    return f'<div class="bar"><i style="width:{100 * min(max(share, 0.0), 1.0):.0f}%"></i></div>'


def paragraph(sentence: str) -> str:
    """Make a paragraph of a sentence that begins in lower case."""
    return f"<p>{escape(sentence[:1].upper() + sentence[1:])}{'' if sentence.endswith(('.', '?', '!')) else '.'}</p>"
