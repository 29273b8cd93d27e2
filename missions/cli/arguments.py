"""Arguments and options that several commands share."""

import os
import sys
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


def assignments(
    pairs: list[str], option: str = "--set", example: str = "dwell=5s"
) -> dict[str, str]:
    """Read repeated NAME=VALUE options.

    Args:
        pairs: the values of the option.
        option: name of the option, for the message.
        example: a correct value, for the message.

    Raises:
        InputError: a value is not NAME=VALUE.
    """
    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name.strip():
            raise InputError(f"{option} {pair}: expected NAME=VALUE, such as {example}")
        values[name.strip()] = value.strip()
    return values


def on_a_terminal() -> bool:
    """Whether standard input and output are a terminal that can show a dashboard."""
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"
