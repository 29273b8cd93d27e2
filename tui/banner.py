"""The banner under the status bar: what an operator must know now, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

from rich.text import Text
from textual.widgets import Static

from stack.telemetry.records import MissionState, Snapshot
from tui.palette import BAD, BUSY, GOOD, TEXT, WARN, css

LOST_AFTER = 5.0
"""Wall seconds of silence after which the engine counts as lost."""

FIRST_WORD_WITHIN = 20.0
"""Likewise before the first snapshot: a first start compiles kernels for some seconds."""

MARGIN = 6
"""Columns of the banner that are not text."""

TONES = {"good": GOOD, "bad": BAD, "warn": WARN, "busy": BUSY}
OUTCOMES = {
    MissionState.SUCCESS: ("good", "✔ MISSION SUCCEEDED"),
    MissionState.FAILURE: ("bad", "✘ MISSION FAILED"),
    MissionState.ABORTED: ("warn", "⊘ MISSION ABORTED"),
    MissionState.INTERRUPTED: ("warn", "⊘ MISSION INTERRUPTED"),
    MissionState.ERROR: ("bad", "✘ INTERNAL ERROR"),
}


@dataclass(frozen=True, slots=True)
class Link:
    """How the engine is heard.

    Attributes:
        silent_for: wall seconds since it was last heard.
        is_over: it has said that the run ended.
        has_report: its report came.
        trouble: why it cannot be understood; empty when it can.
        stop_unconfirmed: an emergency stop was sent a while ago and not answered.
    """

    silent_for: float
    is_over: bool = False
    has_report: bool = False
    trouble: str = ""
    stop_unconfirmed: bool = False

    def is_lost(self, snapshot: Snapshot | None) -> bool:
        """Whether nobody is there any more although the run is not over."""
        over = self.is_over or (snapshot is not None and snapshot.state.is_over)
        patience = FIRST_WORD_WITHIN if snapshot is None else LOST_AFTER
        return not over and self.silent_for > patience


@dataclass(frozen=True, slots=True)
class Notice:
    """Tone (good, bad, warn or busy), headline, why, and what to do."""

    tone: str
    headline: str
    why: str
    then: str


def notice(snapshot: Snapshot | None, link: Link) -> Notice | None:
    """What to say now; None while all goes well."""
    if link.trouble:
        return Notice("bad", "✘ THE ENGINE IS NOT UNDERSTOOD", link.trouble, "q leaves")
    if snapshot is not None and snapshot.state.is_over:
        return _outcome(snapshot)
    if link.is_over:
        return _ended_unseen(link)
    if link.is_lost(snapshot):
        return _lost(snapshot, link.silent_for)
    if link.stop_unconfirmed:
        why = "the engine has not answered; a body that is not driven stops by itself after 0.3 s"
        return Notice("bad", "■ STOP SENT, NOT CONFIRMED", why, "space sends it again")
    return None if snapshot is None else _standing(snapshot)


def _standing(snapshot: Snapshot) -> Notice | None:
    if snapshot.state is MissionState.EMERGENCY_STOP:
        return Notice("bad", "■ EMERGENCY STOP", snapshot.reason, "R releases it")
    if snapshot.state is MissionState.PAUSED:
        return Notice("warn", "‖ PAUSED", snapshot.reason, "p goes on")
    if snapshot.teleop:
        return Notice("busy", "◆ YOU DRIVE", snapshot.safety, "←↑↓→ drive, enter when done")
    return None


def _outcome(snapshot: Snapshot) -> Notice:
    tone, headline = OUTCOMES[snapshot.state]
    minutes, seconds = divmod(snapshot.time, 60)
    figures = f"{int(minutes):02d}:{seconds:04.1f}, {snapshot.counters.get('distance', 0.0):.1f} m"
    recoveries = int(snapshot.counters.get("recoveries", 0))
    if recoveries:
        figures += f", {recoveries} recover{'y' if recoveries == 1 else 'ies'}"
    return Notice(tone, f"{headline}  {figures}", snapshot.reason, "q leaves")


def _ended_unseen(link: Link) -> Notice:
    if link.has_report:
        return Notice("busy", "THE RUN IS OVER", "its report is in the run's folder", "q leaves")
    why = "it ended without a report; the log in the run's folder says how far it came"
    return Notice("bad", "✘ THE ENGINE CRASHED", why, "q leaves")


def _lost(snapshot: Snapshot | None, silent_for: float) -> Notice:
    if snapshot is None:
        why = "is a run alive? `treepilot watch` lists them"
        return Notice("bad", f"✘ NO ENGINE ANSWERS, {silent_for:.0f} s", why, "q leaves")
    why = "a body that is not driven stops by itself after 0.3 s; this picture is old"
    then = "wait for it, or q and `treepilot watch`"
    return Notice("bad", f"✘ ENGINE LOST, silent for {silent_for:.0f} s", why, then)


class Banner(Static):
    """Shows a notice; takes no room without one."""

    def __init__(self) -> None:
        super().__init__(id="banner")
        self.display = False
        self._shown: tuple[Notice | None, int] | None = None

    def show(self, said: Notice | None) -> None:
        """Show a notice, or nothing."""
        wanted = (said, self.app.size.width)
        if wanted == self._shown:
            return
        self._shown = wanted
        self.display = said is not None
        if said is not None:
            self._write(said)

    def _write(self, said: Notice) -> None:
        for tone in TONES:
            self.set_class(tone == said.tone, tone)
        text = Text(said.headline, style=f"bold {css(TONES[said.tone])}")
        then = Text(f"   {said.then}", style=f"bold {css(BUSY)}")
        why = Text(said.why, style=f"not bold {css(TEXT)}")
        if text.cell_len + then.cell_len + why.cell_len + 3 <= self.app.size.width - MARGIN:
            text.append("   " if said.why else "").append_text(why).append_text(then)
        else:
            text.append_text(then).append("\n").append_text(why)
        self.update(text)
