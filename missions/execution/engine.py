"""The engine process behind a dashboard: `python -m missions.execution.engine '{"mission": …}'`.

It owns the robot. SIGINT and SIGTERM end the run as interrupted; the report is still written.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy


def main(message: str) -> int:
    """Run the mission of a JSON message and return the exit code."""
    import json

    from missions.execution.prepare import RunOptions, prepare
    from missions.execution.run import execute
    from stack.errors import InputError

    request = json.loads(message)
    settings = request["options"]
    paths = {key: Path(settings[key]) for key in ("out", "replay") if settings.get(key)}
    options = RunOptions(**{**settings, **paths})
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: caught.append(received))
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        report = execute(prepare(request["mission"], options), options, (), lambda: bool(caught))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return report.exit_code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
