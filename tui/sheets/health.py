"""Health: rates of sensors, compute time of stages, memory, links and records."""

from __future__ import annotations

from math import isfinite

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import VerticalScroll
from textual.widgets import Static

from stack.telemetry.records import Snapshot, StageTiming
from stack.types import LoopStatistics, SensorState
from tui.drawing.palette import BAD, BUSY, DIM, GOOD, IDLE, TEXT, WARN, css
from tui.drawing.strips import one_line
from tui.link import STALE_AFTER, Link
from tui.sheets.sheet import Sheet, Shown

NAME = 18
OLD_AFTER = 1.0
"""Age of a measurement of a sensor with a stated rate that is shown as a fault, s."""


class HealthSheet(Sheet):
    """Shows whether every part delivers what it should."""

    def compose(self) -> ComposeResult:
        """Compose one scrollable text."""
        with VerticalScroll(classes="sheet") as sheet:
            sheet.border_title = "Health"
            sheet.border_subtitle = "H or esc closes"
            yield Static(f"[{css(DIM)}]waiting for the robot[/]")

    def fill(self, shown: Shown) -> None:
        """Show the figures of a snapshot."""
        text = Text(no_wrap=True, overflow="ellipsis")
        _sensors(text, shown.snapshot)
        _stages(text, shown.snapshot)
        if shown.snapshot.fast_loop is not None:
            _fast_loop(text, shown.snapshot.fast_loop)
        _process(text, shown.snapshot, shown.link)
        self.query_one(Static).update(text)


def _head(text: Text, *columns: str) -> None:
    text.append(columns[0].ljust(NAME + 2), style=f"bold {css(BUSY)}")
    text.append("".join(f"{column:>12}" for column in columns[1:]) + "\n", style=css(DIM))


def _row(text: Text, name: str, colour: int, *columns: str) -> None:
    glyph = {GOOD: "✔", BAD: "✘", WARN: "▲"}.get(colour, "·")
    text.append(f"{glyph} ", style=css(colour))
    text.append(f"{one_line(name):<{NAME}}", style=css(TEXT))
    text.append("".join(f"{column:>12}" for column in columns) + "\n", style=css(colour))


def _sensors(text: Text, snapshot: Snapshot) -> None:
    _head(text, "Sensors", "rate", "expected", "age")
    faults = {camera.name: camera.fault for camera in snapshot.cameras if camera.fault}
    for sensor in snapshot.sensors:
        expected = f"{sensor.expected:g} Hz" if sensor.expected else "-"
        age = f"{sensor.age:.2f} s" if isfinite(sensor.age) else "nothing yet"
        fault = faults.get(sensor.name, "")
        colour = BAD if fault else sensor_colour(sensor)
        _row(text, sensor.name, colour, f"{sensor.rate:.1f} Hz", expected, age, fault)
    if not snapshot.sensors:
        text.append("  no sensor has delivered anything\n", style=css(DIM))


def sensor_colour(sensor: SensorState) -> int:
    """Green, yellow or red by rate and age; grey without a stated rate."""
    if not sensor.expected:
        return IDLE
    if sensor.age > max(OLD_AFTER, 5.0 / sensor.expected):
        return BAD
    return WARN if sensor.is_slow else GOOD


def stage_colour(stage: StageTiming) -> int:
    """Red if half of the runs are late, yellow if one of a hundred is."""
    return BAD if stage.median > stage.budget else WARN if stage.slow > stage.budget else GOOD


def _stages(text: Text, snapshot: Snapshot) -> None:
    text.append("\n")
    _head(text, "Compute time", "p50", "p99", "worst", "late")
    for name, stage in snapshot.stages.items():
        times = (f"{value * 1e3:.2f} ms" for value in (stage.median, stage.slow, stage.worst))
        _row(text, name, stage_colour(stage), *times, f"{stage.overruns}×")
    budget = next((stage.budget for stage in snapshot.stages.values()), 0.0)
    text.append(f"  the budget of a step is {budget * 1e3:g} ms\n", style=css(DIM))


def loop_colour(loop: LoopStatistics) -> int:
    """Red if the loop misses one of a thousand deadlines, yellow if any, or for want of rights."""
    if loop.overruns > loop.cycles / 1000:
        return BAD
    return WARN if loop.overruns or loop.lacks else GOOD


def _fast_loop(text: Text, loop: LoopStatistics) -> None:
    text.append("\n")
    _head(text, "Fast loop", "late p50", "p99.9", "worst", "work", "missed")
    late = (loop.percentile(0.5), loop.percentile(0.999), loop.worst, loop.work)
    times = (f"{value * 1e6:.0f} µs" for value in late)
    _row(text, f"{loop.rate:g} Hz", loop_colour(loop), *times, f"{loop.overruns}×")
    for lack in loop.lacks:
        _row(text, f"without {lack}", WARN)


def _process(text: Text, snapshot: Snapshot, link: Link) -> None:
    text.append("\n")
    _head(text, "Engine")
    lines = [("memory", GOOD, f"{snapshot.memory / 1e6:.0f} MB" if snapshot.memory else "unknown")]
    if link.is_replay:
        lines.append(("link", IDLE, "a recorded run"))
    else:
        stale = link.silent_for > STALE_AFTER
        heard = f"last message {link.silent_for:.1f} s ago"
        lines.append(("link", BAD if stale else GOOD, heard))
    pace = f"{snapshot.speed:.1f} × real time"
    lines.append(("simulation", GOOD, f"{pace}, wanted {snapshot.pace:g} ×" if snapshot.pace else
                  f"{pace}, as fast as possible"))  # fmt: skip
    lost = snapshot.records_lost
    lines.append(("records", BAD if lost else GOOD, lost or "complete"))
    if snapshot.localisation_fault:
        lines.append(("localisation", BAD, snapshot.localisation_fault))
    for name, colour, value in lines:
        _row(text, name, colour)
        text.right_crop(1)
        text.append(f"  {one_line(value)}\n", style=css(colour))
