"""The viewer process: `python -m tui ADDRESS IDENTITY`."""

from __future__ import annotations

import sys

from stack.telemetry.client import TelemetryClient
from tui.viewer import show


def main(address: str) -> int:
    """Show the run at an address."""
    client = TelemetryClient(address)
    show(client)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
