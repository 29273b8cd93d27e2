"""The dashboard as a process of its own: `python -m tui ADDRESS IDENTITY [DESCRIPTOR] [ROLE]`.

With the role `owner` or `demo`, ctrl+c ends the run; otherwise it asks. With `demo`, the banner
says what the robot does, and what to press.

It writes one JSON object to the file descriptor: `outcome`, and after a crash `trouble` (one line)
and `traceback`. The exit code is 0, or 3 after a crash. SIGTERM and SIGINT end it with the outcome
`terminated`: the supervisor gets those that mean the run itself. SIGHUP and a closed terminal end
it with `hangup`.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from contextlib import suppress

from stack.telemetry.client import TelemetryClient
from stack.telemetry.rendezvous import RunHandle
from tui.viewer import show

CRASHED = 3
LONGEST_TRACEBACK = 20_000
"""Characters; the object fits into a pipe that nobody reads yet."""


def main(address: str, identity: str, descriptor: str = "", owner: str = "") -> int:
    """Show the run with this address and identity; return the exit code."""
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: caught.append(received))
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # the closed terminal is noticed anyway
    parent = os.getppid()
    run = RunHandle(
        identity, run_id="", robot="", mission="", folder="", pid=0, address=address, since=""
    )
    outcome = show(
        TelemetryClient(run), lambda: bool(caught) or os.getppid() != parent,
        owns_run=owner in ("owner", "demo"), is_demo=owner == "demo",
    )  # fmt: skip
    answer = {"outcome": outcome.name}
    if outcome.traceback:
        answer |= {"trouble": outcome.trouble, "traceback": outcome.traceback[-LONGEST_TRACEBACK:]}
    if descriptor:
        try:
            os.write(int(descriptor), json.dumps(answer).encode())
        except OSError:  # the process that opened this dashboard is gone
            with suppress(OSError):
                print("the mission continues; attach with: treepilot watch", file=sys.stderr)
    elif outcome.traceback:
        with suppress(OSError):
            print(f"the dashboard crashed: {outcome.trouble}", file=sys.stderr)
    return CRASHED if outcome.traceback else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
