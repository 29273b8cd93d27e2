"""The dashboard as a process of its own: `python -m tui ADDRESS IDENTITY DESCRIPTOR`."""

import json
import os
import sys

from stack.telemetry.client import TelemetryClient
from stack.telemetry.rendezvous import find_run
from tui.app import Dashboard

if __name__ == "__main__":
    client = TelemetryClient(find_run(sys.argv[2]))
    parent = os.getppid()
    outcome = Dashboard(client, interrupted=lambda: os.getppid() != parent).run() or "over"
    os.write(int(sys.argv[3]), json.dumps({"outcome": outcome}).encode())
