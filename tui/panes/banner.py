"""Banner below the status bar: the situation that needs the operator's attention, and the keys."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rich.text import Text
from textual.widgets import Static

from stack.telemetry.records import ROUTINE, MissionState, Snapshot
from stack.telemetry.tree_text import deepest_running
from tui.drawing.palette import BUSY, TEXT, TONES, css
from tui.drawing.strips import clock, one_line
from tui.link import Link

MARGIN = 6
"""Columns of padding in the banner."""

OUTCOMES = {
    MissionState.SUCCESS: ("good", "✔ MISSION SUCCEEDED"),
    MissionState.FAILURE: ("bad", "✘ MISSION FAILED"),
    MissionState.ABORTED: ("warn", "⊘ MISSION ABORTED"),
    MissionState.INTERRUPTED: ("warn", "⊘ MISSION INTERRUPTED"),
    MissionState.ERROR: ("bad", "✘ INTERNAL ERROR"),
}


GOAL_KEYS = "p pauses, G cancels it"


@dataclass(frozen=True, slots=True)
class Notice:
    """Content of the banner: tone (good, bad, warn or busy), headline, detail and keys to press.

    A steady one always has two lines, so that the panes below do not move.
    """

    tone: str
    headline: str
    detail: str
    keys: str
    is_steady: bool = False


def notice(snapshot: Snapshot | None, link: Link) -> Notice | None:
    """Return the notice for the current situation; None in normal operation."""
    found = _notice(snapshot, link)
    return replace(found, keys="") if found is not None and link.is_replay else found


def _notice(snapshot: Snapshot | None, link: Link) -> Notice | None:
    if link.trouble:
        return Notice("bad", "✘ INCOMPATIBLE ENGINE", link.trouble, "q leaves")
    if snapshot is not None and snapshot.state.is_over:
        return _outcome(snapshot)
    if link.is_over:
        return _ended_before_snapshot(link)
    if link.is_lost(snapshot):
        return _lost(snapshot, link.silent_for)
    if link.stop_unconfirmed:
        detail = "the engine has not answered; without commands a robot stops by itself after 0.3 s"
        return Notice("bad", "■ STOP NOT CONFIRMED", detail, "space sends it again")
    return None if snapshot is None else _held(snapshot) or _records_lost(snapshot)


DEMO_KEYS = "B drops a box · O closes a door · L lifts the robot · D more"

LATELY = 6.0
"""Seconds for which the demo shows an event."""


def demo_notice(snapshot: Snapshot) -> Notice:
    """Say what the robot does: why it is slow, else what happened last, else its running node."""
    told = [
        event.text
        for event in snapshot.events
        if event.kind not in ROUTINE and event.time > snapshot.time - LATELY
    ]
    row = deepest_running(snapshot.tree)
    doing = f"{row.name}: {row.message}" if row is not None else str(snapshot.state)
    return Notice(
        "busy", "◆ DEMO", snapshot.safety or (told[-1] if told else doing), DEMO_KEYS, True
    )


def _held(snapshot: Snapshot) -> Notice | None:
    if snapshot.state is MissionState.EMERGENCY_STOP:
        return Notice("bad", "■ EMERGENCY STOP", snapshot.reason, "R releases it")
    paused = snapshot.state is MissionState.PAUSED
    if snapshot.detour:
        return Notice("busy", "⚑ OPERATOR'S DETOUR", "the mission is paused", GOAL_KEYS)
    if snapshot.detour_held:
        return Notice(
            "warn", "‖ YOUR GOAL IS PAUSED", "so is the mission", "p drives on, G cancels"
        )
    if snapshot.debugging.faults:
        return _reload_failed(snapshot.debugging.faults, paused)
    if paused and snapshot.debugging.held:
        where = snapshot.reason.removeprefix("stopped at breakpoint: ")
        return Notice(
            "warn", "● STOPPED AT BREAKPOINT", where, "p continues; in the tree n: one tick"
        )
    if paused:
        return Notice("warn", "‖ PAUSED", snapshot.reason, "p continues")
    if snapshot.teleop:
        return Notice("busy", "◆ TELEOPERATION", snapshot.safety, "←↑↓→ drive, enter when done")
    return None


def _records_lost(snapshot: Snapshot) -> Notice | None:
    if not snapshot.records_lost:
        return None
    return Notice("warn", "▲ RECORDS LOST", snapshot.records_lost, "the mission continues")


def _reload_failed(faults: tuple[str, ...], paused: bool) -> Notice:
    """Return the notice for a mission file that was saved with errors."""
    headline = "✘ RELOAD FAILED" + (", ‖ PAUSED" if paused else "")
    more = f"; and {len(faults) - 1} more in the log" if len(faults) > 1 else ""
    return Notice("bad", headline, faults[0] + more, "old tree continues; fix and save")


def _outcome(snapshot: Snapshot) -> Notice:
    tone, headline = OUTCOMES[snapshot.state]
    detail = "; ".join(filter(None, (snapshot.reason, snapshot.records_lost)))
    figures = f"{clock(snapshot.time)}, {snapshot.counters.get('distance', 0.0):.1f} m"
    recoveries = int(snapshot.counters.get("recoveries", 0))
    if recoveries:
        figures += f", {recoveries} recover{'y' if recoveries == 1 else 'ies'}"
    return Notice(tone, f"{headline}  {figures}", detail, "q leaves")


def _ended_before_snapshot(link: Link) -> Notice:
    if link.has_report:
        return Notice("busy", "RUN ENDED", "the report is in the run folder", "q leaves")
    detail = "it ended without a report; see the log in the run folder"
    return Notice("bad", "✘ ENGINE CRASHED", detail, "q leaves")


def _lost(snapshot: Snapshot | None, silent_for: float) -> Notice:
    if snapshot is None:
        detail = "check with `treepilot watch` whether a run is alive"
        return Notice("bad", f"✘ NO ENGINE ANSWERS, {silent_for:.0f} s", detail, "q leaves")
    detail = "without commands a robot stops by itself after 0.3 s; this screen is out of date"
    keys = "wait, or q and `treepilot watch`"
    return Notice("bad", f"✘ ENGINE LOST, silent for {silent_for:.0f} s", detail, keys)


class Banner(Static):
    """Shows a notice; hidden without one."""

    def __init__(self) -> None:
        super().__init__(id="banner")
        self.display = False
        self._shown: tuple[Notice | None, int] | None = None

    def show(self, current: Notice | None) -> None:
        """Show a notice, or hide the banner."""
        wanted = (current, self.app.size.width)
        if wanted == self._shown:
            return
        self._shown = wanted
        self.display = current is not None
        if current is not None:
            self._write(current)

    def _write(self, current: Notice) -> None:
        for tone in TONES:
            self.set_class(tone == current.tone, tone)
        text = Text(current.headline, style=f"bold {css(TONES[current.tone])}")
        keys = Text(f"   {current.keys}", style=f"bold {css(BUSY)}")
        detail = Text(one_line(current.detail), style=f"not bold {css(TEXT)}")
        room = self.app.size.width - MARGIN
        if current.is_steady:
            detail.truncate(room, overflow="ellipsis")
        fits = text.cell_len + keys.cell_len + detail.cell_len + 3 <= room
        if fits and not current.is_steady:
            text.append("   " if current.detail else "").append_text(detail).append_text(keys)
        else:
            text.append_text(keys).append("\n").append_text(detail)
        self.update(text)
