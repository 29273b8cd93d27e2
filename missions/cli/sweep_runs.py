"""Progress and end of the commands that make many runs: `sweep`, `tune`, `bench missions`."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer

from stack.errors import InputError

Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Dask scheduler whose workers make the runs: tcp://HOST:PORT"
    ),
]

INTERRUPTED = 130
"""Exit code."""


@contextmanager
def interruptible(folder: Path) -> Iterator[Callable[[], None]]:
    """End a command with 130 at Ctrl-C, SIGTERM or SIGHUP, and say how to continue.

    Of SIGTERM and SIGHUP only the first one counts: another one does not cut off what is being
    written.

    Yields what the loop of the runs calls: it raises KeyboardInterrupt after a signal. The handler
    raises it too, but wherever the signal arrives; Python drops it there in callbacks of the
    garbage collector, for example.

    Args:
        folder: of the results.
    """
    wanted = [
        number for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        if signal.getsignal(number) is not signal.SIG_IGN  # nohup
    ]  # fmt: skip
    received: list[int] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        received.append(number)
        if number != signal.SIGINT:
            for other in {*wanted} - {signal.SIGINT}:
                signal.signal(other, signal.SIG_IGN)
        raise KeyboardInterrupt

    def check() -> None:
        if received:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in wanted}
    try:
        yield check
    except KeyboardInterrupt:
        tell(f"interrupted; {folder} has the finished runs: run the command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check_cluster(cluster: str | None, jobs: int | None) -> None:
    """Refuse `--cluster` without an address or Dask, or with `--jobs`.

    Raises:
        InputError: one of them is so.
    """
    from stack.optional_packages import DISTRIBUTED

    if cluster is None:
        return
    if not cluster.strip():
        raise InputError("--cluster has no address", "write tcp://HOST:PORT")
    if jobs is not None:
        raise InputError(
            "--jobs is the number of processes of this machine, and --cluster uses others",
            "leave --jobs out: the runs are made by as many processes as the cluster has",
        )
    DISTRIBUTED.require("--cluster needs")


def progress(total: int) -> Any:
    """Return what shows the progress of a number of runs, on a terminal in one line."""
    from missions.sweeps.progress import Progress

    def show(line: str) -> None:
        sys.stderr.write(f"\r{line}\x1b[K")
        sys.stderr.flush()

    return Progress(total, show, tell, overwrites=sys.stderr.isatty())


def tell(line: str) -> None:
    """Print a line on standard error, in place of a line of progress."""
    ahead = "\r\x1b[K" if sys.stderr.isatty() else ""
    typer.echo(f"{ahead}{line}", err=True)
