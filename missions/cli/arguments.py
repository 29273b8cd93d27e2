"""Arguments and options that several commands share."""

import os
import sys
from contextlib import suppress
from typing import Annotated

import typer

from stack.errors import InputError

MissionArgument = Annotated[
    str, typer.Argument(help="mission file, or the name of a shipped mission")
]

PluginsOf = Annotated[
    str | None,
    typer.Option("--mission", metavar="FILE", help="include this mission's plugins"),
]


Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="set a mission argument; repeatable"),
]

OtherRobot = Annotated[
    str | None, typer.Option("--robot", help="use another robot: a name or a robot.yaml")
]

Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter",
        metavar="NAME=VALUE",
        help="override a parameter, e.g. controller.cruise_speed=0.4",
    ),
]


View = Annotated[bool, typer.Option("--view", help="also show the run live in rerun's viewer")]


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: `1 file`, `6 errors`."""
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"


def assignments(
    pairs: list[str], option: str = "--set", example: str = "dwell=5s"
) -> dict[str, str]:
    """Read repeated NAME=VALUE options.

    Args:
        pairs: the values of the option.
        option: name of the option, for the message.
        example: a correct value, for the message.

    Raises:
        InputError: a value is not NAME=VALUE, or a name is given twice.
    """
    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name.strip():
            raise InputError(f"{option} {pair}: expected NAME=VALUE, such as {example}")
        if name.strip() in values:
            raise InputError(f"{option} {pair}: {name.strip()} is given twice", "leave one out")
        values[name.strip()] = value.strip()
    return values


def on_a_terminal() -> bool:
    """Whether this process has a terminal that can show a dashboard; says so if it cannot.

    The dashboard reads standard input and draws on standard error. A terminal cannot show it
    without cursor positions as in ECMA-48. One that the terminal database does not know may.

    Raises:
        InputError: the environment asks for a theme that does not exist.
    """
    if not all(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr)):
        return False
    term = os.environ.get("TERM", "")
    able = term not in ("", "dumb", "unknown")
    if able:
        import curses

        with suppress(curses.error):
            curses.setupterm(term, sys.stderr.fileno())
            able = (curses.tigetstr("cup") or b"").startswith(b"\x1b[")
    if not able:
        kind = f"TERM={term}" if term else "TERM is not set"
        print(f"this terminal cannot show the dashboard ({kind})", file=sys.stderr)
        return False
    from missions.execution.supervision.viewer import check_settings

    check_settings()
    return True
