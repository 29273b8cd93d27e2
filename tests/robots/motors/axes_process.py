"""Emulated axes as a process of its own, for tests and benchmarks."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

GROUP = "239.74.163.2"
WAITS = 30.0


def free_channel() -> str:
    """A channel of `udp_multicast` on a free port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return f"{GROUP}:{probe.getsockname()[1]}"


class AxesProcess:
    """Orders to the axes, and the lines that they print."""

    def __init__(self, process, channel):
        self.process, self.channel, self.lines = process, channel, []

    @property
    def driver(self):
        """Parameters of the driver."""
        return {"interface": "udp_multicast", "channel": self.channel, "nodes": [0, 1]}

    def order(self, **values):
        """Change the axes; return the time and, of each axis, (turns, turns/s) just then."""
        self.process.stdin.write(json.dumps(values) + "\n")
        self.process.stdin.flush()
        _, at, *axes = self.await_line("changed")
        return float(at), [tuple(map(float, axis.split(":"))) for axis in axes]

    def await_line(self, word):
        """Wait for a line that begins with a word; return it as words."""
        limit = time.monotonic() + WAITS  # noqa: TID251
        while time.monotonic() < limit:  # noqa: TID251
            words = self.process.stdout.readline().split()
            assert words, "the axes have ended"
            self.lines.append(words)
            if words[0] == word:
                return words
        raise AssertionError(f"no line {word!r}")


@contextmanager
def axes_process(channel=None, nodes=(0, 1)):
    """Start axes; they end with the block."""
    channel = channel or free_channel()
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.robots.motors.emulated_axes", "udp_multicast", channel,
         *map(str, nodes)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    axes = AxesProcess(process, channel)
    try:
        axes.await_line("ready")
        yield axes
    finally:
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()
