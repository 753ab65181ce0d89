"""Define the options of a real arm, parse them, and ask whether it may move."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import urlsplit

import typer

from agent.cli.options import JACO
from agent.errors import RobotRefused, UsageError
from grounding.parse_result import shortened

if TYPE_CHECKING:
    from agent.pipeline.real_arm import RobotOptions

SCHEME, PORT = "rosbridge", 9090
YES = ("y", "yes")
_LEGAL = f"--robot cannot be {{}}; legal: {SCHEME}://HOST:PORT, or simulation"

RobotOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Arm that carries out what the simulation has built, after you agree: rosbridge://HOST:PORT, or "
        "simulation for a second table in physics. Needs the extra `robot`.",
    ),
]
ApproveOption = Annotated[
    bool, typer.Option("--approve", help="Let the arm behind --robot move without asking. Required without a terminal.")
]


def robot_options(
    robot: str | None, arm: str | None, approve: bool, execute: bool, hold: str, disturb: str | None
) -> RobotOptions | None:
    """Return the arm that a run asks for; `None` without `--robot`.

    Raises:
        UsageError: for an address or a name that is not legal, and for options that do not go together.
        RobotRefused: if nobody could be asked.
    """
    if robot is None:
        if approve or (arm or "").startswith(f"{JACO}:"):
            raise UsageError(f"{'--approve' if approve else '--arm ' + JACO + ':NAME'} needs --robot")
        return None
    from agent.pipeline.real_arm import SIMULATION, RobotOptions

    for wrong, told in (
        (not execute, "--robot needs the motions of a build, and --no-execute plans none"),
        (hold != "friction", "--robot cannot use --hold weld, because a real hand has no weld"),
        (disturb is not None, "--robot carries out one fixed plan, and --disturb changes the plan"),
    ):
        if wrong:
            raise UsageError(f"{told}; leave out one of them")
    name = _arm_name(arm)
    address = SIMULATION if robot == SIMULATION else _address(robot)
    if not approve and (sys.stdin is None or not sys.stdin.isatty()):
        raise RobotRefused(
            "the arm moves only after approval, and there is no terminal to ask in; --approve gives the approval in "
            "advance"
        )
    return RobotOptions(address, _told if approve else _asked, name)


def _address(robot: str) -> str:
    try:
        parts = urlsplit(robot)
        host, port = parts.hostname, parts.port or PORT
    except ValueError as error:
        raise UsageError(f"{_LEGAL.format(repr(shortened(robot)))} ({error})") from error
    rest = (parts.username, parts.path.strip("/"), parts.query, parts.fragment)
    if parts.scheme != SCHEME or not host or any(rest):
        raise UsageError(_LEGAL.format(repr(shortened(robot))))
    return f"ws://{f'[{host}]' if ':' in host else host}:{port}"


def _arm_name(arm: str | None) -> str | None:
    """Return the name of a Jaco's driver; `None` for the usual one, and for an arm from a file."""
    kind, _, name = (arm or JACO).partition(":")
    if kind != JACO and Path(arm or "").is_file():
        return None
    if kind != JACO or (":" in (arm or "") and not name.replace("_", "").isalnum()):
        raise UsageError(
            f"--arm cannot be {shortened(arm or '')!r} with --robot; legal: jaco, jaco:NAME with a name of ROS, or the "
            "YAML file of an arm"
        )
    return name or None


def _told(question: str) -> bool:
    print(question, file=sys.stderr)
    return True


def _asked(question: str) -> bool:
    """Ask in the terminal; anything but a yes is a no."""
    print(f"{question}\nMove the arm now? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in YES
