import json
import os
import sys

from stack.telemetry.client import TelemetryClient
from tui.app import Dashboard

client = TelemetryClient(sys.argv[1])
outcome = Dashboard(client, interrupted=lambda: False).run() or "over"
os.write(int(sys.argv[3]), json.dumps({"outcome": outcome}).encode())
