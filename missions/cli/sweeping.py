"""What the commands of sweeps share: progress, lines for people, and errors that name an option."""

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import typer

from stack.errors import InputError

T = TypeVar("T")


def read_option(option: str, read: Callable[[str], T], text: str) -> T:
    """Read the value of an option, which errors name."""
    try:
        return read(text)
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


def progress_of(total: int) -> Any:
    """Return what shows how many of the runs are over."""
    from missions.sweeps.progress import Progress

    def show(line: str) -> None:
        sys.stderr.write(f"\r{line}\x1b[K")
        sys.stderr.flush()

    return Progress(total, show, tell, overwrites=sys.stderr.isatty())


def tell(line: str) -> None:
    """Write a line for people, over a line of progress."""
    ahead = "\r\x1b[K" if sys.stderr.isatty() else ""
    typer.echo(f"{ahead}{line}", err=True)
