"""`treepilot watch`: attach a dashboard to a live run."""

from __future__ import annotations

import signal
import sys
from dataclasses import asdict

from missions.execution.report import INTERNAL_ERROR, INTERRUPTED
from missions.execution.supervision.supervisor import POLL
from missions.execution.supervision.viewer import Viewer
from stack.telemetry.rendezvous import find_run


def watch_run(name: str) -> int:
    """Attach the dashboard to a live run; an empty name is the only one.

    Raises:
        TelemetryError: there is no such run, or more than one.
    """
    run = find_run(name)
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda received, _: caught.append(received))
    viewer = Viewer(asdict(run))
    while viewer.is_open and not caught:
        viewer.wait(POLL)
    outcome = viewer.close()
    if outcome == "abort":
        print(f"aborted {run.run_id}", file=sys.stderr)
    if outcome == "terminated" and not caught:
        print("the dashboard was ended by a signal; the mission continues", file=sys.stderr)
    if outcome == "crashed":
        print(f"the dashboard crashed: {viewer.trouble}; the mission continues", file=sys.stderr)
        return INTERNAL_ERROR
    return INTERRUPTED if caught else 0
