"""`report.html`: one self-contained page, made from the report and the pictures; nothing is loaded from elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from agent.pictures import color_of
from agent.session_file import Session
from agent.telling import arm_sentence, duration, number, slot_label

_CANDIDATES_SHOWN = 8


def page(
    turns: Sequence[tuple[Mapping[str, Any], Mapping[str, bytes]]], session: Session | None = None
) -> str:
    """The page (HTML) of one turn or several: each a report, `agent.record`'s dictionary, and its pictures (WebP)."""
    title = escape(turns[0][0]["instruction"] or "no instruction" if session is None else f"session of {session.started}")
    body = []
    for report, pictures in turns:
        caption_of = {entry["name"]: entry["caption"] for entry in report["pictures"]}
        album = {name: _figure(content, caption_of[name]) for name, content in pictures.items()}
        body += [
            _header(report, escape(report["instruction"] or "no instruction")),
            _parse(report),
            _scene(report, album),
            _imagination(report, album),
            _arm(report, album),
            _verdict(report, album),
            _footer(report),
        ]
    style = files("agent").joinpath("report.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>structagent: {title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(part for part in body if part)
        + "\n</main>\n</body>\n</html>\n"
    )


def _figure(content: bytes, caption: str) -> str:
    source = base64.b64encode(content).decode("ascii")
    text = escape(caption)
    return f'<figure><img alt="{text}" src="data:image/webp;base64,{source}"><figcaption>{text}</figcaption></figure>'


def _album(figures: Sequence[str | None], kind: str = "pictures") -> str:
    there = [figure for figure in figures if figure]
    return f'<div class="{kind}">{"".join(there)}</div>' if there else ""


def _section(title: str, content: str, seconds: float | None = None) -> str:
    note = f' <span class="soft">{duration(seconds)}</span>' if seconds is not None else ""
    return f"<section>\n<h2>{escape(title)}{note}</h2>\n{content}\n</section>"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], chosen: int | None = None) -> str:
    lines = "".join(
        ('<tr class="chosen">' if index == chosen else "<tr>") + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>"
        for index, row in enumerate(rows)
    )
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{lines}</tbody></table></div>'


def _bar(share: float) -> str:
    return f'<div class="bar"><i style="width:{100 * min(max(share, 0.0), 1.0):.0f}%"></i></div>'


def _header(report: Mapping[str, Any], title: str) -> str:
    outcome = report["outcome"]
    if outcome["success"]:
        badge = '<span class="badge good">Built as asked</span>'
        if not report["options"].get("execute", True):
            badge = '<span class="badge good">A valid goal was found</span>'
    else:
        badge = '<span class="badge bad">Not built</span>'
    why = f" {escape(outcome['message'])}" if outcome["message"] else ""
    return f'<header><p class="kicker">structagent</p><h1>“{title}”</h1><p>{badge}{why}</p></header>'


def _parse(report: Mapping[str, Any]) -> str:
    parse = report["parse"]
    if parse is None:
        return ""
    slots = []
    for slot, value in parse["spec"].items():
        words = ", ".join(parse["evidence"].get(slot) or ())
        sure = parse["confidence"].get(slot)
        slots.append(
            f'<div class="{"slot" if value else "slot open"}"><span class="soft">{escape(slot_label(slot))}</span>'
            f"<b>{escape(value or 'left open')}</b>"
            + (f'<span class="soft">{number(100 * sure)} % sure</span>{_bar(sure)}' if sure is not None else "")
            + (f'<span class="soft">from “{escape(words)}”</span>' if words else "")
            + "</div>"
        )
    named = ", ".join(parse["named"])
    note = f"<p>Named: {escape(named)}.</p>" if named else "<p>No object is named: all take part.</p>"
    if parse["viewpoint"] != "robot":
        note += f"<p>Spoken from the {escape(parse['viewpoint'])} side of the table, turned to the robot's.</p>"
    if parse["fallback"]:
        note += f"<p>{escape(parse['fallback'])}</p>"
    for slot, value in parse["dropped"].items():
        note += f"<p>Left out, because it does not go with the rest: {escape(slot_label(slot))} {escape(value)}.</p>"
    return _section("What was understood", note + f'<div class="slots">{"".join(slots)}</div>',
                    report["seconds"].get("parse"))


def _scene(report: Mapping[str, Any], album: Mapping[str, str]) -> str:
    scene = report["scene"]
    if scene is None:
        return ""
    rows = [
        (
            (f'<span class="dot" style="background:rgb{color_of(index)}"></span>' if seen["takes_part"] else "")
            + escape(seen["name"]),
            escape(seen["category"]),
            "takes part" if seen["takes_part"] else '<span class="soft">stays where it is</span>',
            ", ".join(number(100 * value) for value in seen["position"]),
            str(seen["points"]),
        )
        for index, seen in enumerate(scene["objects"])
    ]
    table = _table(("object", "noun", "role", "mean seen position x, y, z (cm)", "points seen"), rows)
    return _section("The scene before", _album([album.get("camera-before"), album.get("scene-before")]) + table,
                    report["seconds"].get("scene"))


def _imagination(report: Mapping[str, Any], album: Mapping[str, str]) -> str:
    imagination, chosen = report["imagination"], report["chosen"]
    if imagination is None:
        return ""
    candidates = imagination["candidates"]
    names = list(candidates[0]["scores"]) if candidates else []
    rows = [
        [str(candidate["rank"]), *(number(candidate["scores"][name], 3) + _bar(candidate["scores"][name] or 0.0)
                                   for name in names)]
        for candidate in candidates
    ]
    head = ["rank", *names]
    index = chosen["rank"] - 1 if chosen else None
    content = _album([album.get("imagined-goal")])
    content += f"<p>{len(candidates)} candidates by the model “{escape(imagination['model'])}”, best first.</p>"
    content += _table(head, rows[:_CANDIDATES_SHOWN], index)
    if len(rows) > _CANDIDATES_SHOWN:
        rest = _table(head, rows[_CANDIDATES_SHOWN:], None if index is None else index - _CANDIDATES_SHOWN)
        content += f"<details><summary>the other {len(rows) - _CANDIDATES_SHOWN}</summary>{rest}</details>"
    return _section("What was imagined", content, report["seconds"].get("imagination"))


def _arm(report: Mapping[str, Any], album: Mapping[str, str]) -> str:
    if not report["arm"]:
        return ""
    names = [seen["name"] for seen in report["scene"]["objects"]]
    lines = "".join(f"<li>{escape(arm_sentence(told, names))}</li>" for told in report["arm"])
    figures = [figure for name, figure in album.items() if name.startswith("placement-")]
    content = f'<ol class="story">{lines}</ol>' + _album(figures, "pictures small")
    return _section("Building it", content, report["seconds"].get("build"))


def _verdict(report: Mapping[str, Any], album: Mapping[str, str]) -> str:
    verdict = report["verdict"]
    if verdict is None:
        return ""
    rows = [
        (
            '<span class="good">passed</span>' if check["passed"] else '<span class="bad">failed</span>',
            escape(check["name"]),
            number(check["measured"], 3),
            escape(check["limit"]),
        )
        for check in verdict["checks"]
    ]
    how = "built by the arm" if verdict["how"] == "arm" else "released 3 cm above the goal, without the arm"
    result = "It stands as asked" if verdict["success"] else f"{verdict['failure_class']}: {verdict['detail']}"
    content = f"<p>{escape(result)}. Checked on the true objects at rest, {how}.</p>"
    if rows:
        content += _table(("", "check", "measured", "limit"), rows)
    return _section("After", _album([album.get("camera-after")]) + content, report["seconds"].get("check"))


def _footer(report: Mapping[str, Any]) -> str:
    seconds = " · ".join(f"{escape(step)} {duration(value)}" for step, value in report["seconds"].items())
    options = ", ".join(f"{escape(str(key))} {escape(str(value))}" for key, value in report["options"].items())
    total = report["outcome"]["seconds"]
    whole = f" · whole run {duration(total)}" if total is not None else ""
    return f"<footer><p>{seconds}{whole}</p><p>structagent {escape(report['version'])}: {options}</p></footer>"
