"""A real run in the test's own hands: steps, a watch whose clock counts steps, events kept."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent
from uuid import uuid4

from missions.execution.build import build, run_info
from missions.execution.file_watcher import FileWatch
from missions.execution.prepare import RunOptions, prepare
from missions.execution.reload import Reloader
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Command
from stack.telemetry.sinks import Sink

HEAD = "mission: lively\nrobot: scout\nworld: small_room\n"
PERIOD = 0.05


class Kept(Sink):
    """A sink that keeps events and lets the test command."""

    def __init__(self):
        self.events, self.orders, self.acks = [], [], []

    def event(self, event):
        self.events.append(event)

    def service(self):
        pass

    def commands(self):
        given, self.orders = self.orders, []
        return given

    def silence(self):
        return None

    def acknowledge(self, ack):
        self.acks.append(ack)


class LiveRun:
    """A mission in a file of its own, watched; `save` writes it as an editor would."""

    def __init__(self, folder: Path, text: str, head=HEAD, make_body=None, **options) -> None:
        folder.mkdir(exist_ok=True)
        self.head = head
        self.file = folder / "lively.yaml"
        self.save(text)
        self.kept = Kept()
        self.options = RunOptions(**{"seed": 1, "watch": True, "serve": False} | options)
        plan = prepare(self.file, self.options)
        self.telemetry = Telemetry(run_info(plan, "run", 1), [self.kept])
        self.engine = build(plan, self.options, self.telemetry, None, make_body)
        self.runtime = self.engine.runtime
        self._clock = 0
        files = FileWatch([], clock=lambda: self._clock * PERIOD)
        self.reloader = Reloader(self.engine, plan, self.options, None, files)

    def save(self, text: str, name: str = "") -> None:
        """Replace a file by a new one, as editors do; the mission's own gets its head."""
        file = self.file.with_name(name) if name else self.file
        new = file.with_name(f".{uuid4().hex}")
        new.write_text(dedent(text) if name else self.head + dedent(text))
        new.replace(file)

    def steps(self, count: int = 1) -> None:
        """Go on for so many steps, or passes while it is held."""
        for _ in range(count):
            if self.runtime.state.is_over:
                return
            self._clock += 1
            self.reloader.poll()
            self.runtime.step()

    def until(self, kind: str, within: int = 600):
        """Go on until an event of a kind comes; that event."""
        known = len(self.kept.events)
        for _ in range(within):
            self.steps()
            fresh = [event for event in self.kept.events[known:] if event.kind == kind]
            if fresh:
                return fresh[0]
        raise AssertionError(f"no {kind} within {within} steps: {self.texts()}")

    def order(self, kind: str, **arguments):
        """Command, and go on until it is answered; the answer."""
        known = len(self.kept.acks)
        self.kept.orders.append(Command(kind, kind, arguments))
        while len(self.kept.acks) == known:
            self.steps()
        return self.kept.acks[-1]

    def texts(self, *kinds: str) -> list[str]:
        """What events said."""
        return [event.text for event in self.kept.events if not kinds or event.kind in kinds]

    @property
    def speed(self) -> float:
        twist = self.runtime.perceived.motion.twist
        return max(abs(twist.linear), abs(twist.angular))

    @property
    def snapshot(self):
        return self.runtime.snapshot()

    def close(self) -> None:
        self.runtime.parts.navigator.close()
        self.engine.body.close()
