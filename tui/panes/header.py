"""What the header says: one row for each situation, the most urgent first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

from stack.telemetry.records import MissionState, Snapshot
from stack.types.limitations import EMERGENCY_STOP
from tui.link import STALE_AFTER, Link

MOVING_SPEED = 0.02
"""Speed, m/s and rad/s, from which the robot counts as moving."""


@dataclass(frozen=True, slots=True)
class Header:
    """State of the run in a few words.

    Attributes:
        words: what the robot or the engine does now, with a glyph.
        tone: good, bad, warn or busy.
        alarms: what else needs attention whatever the robot does.
    """

    words: str
    tone: str
    alarms: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Situation:
    """A snapshot and the state of the connection."""

    snapshot: Snapshot
    link: Link

    def is_in(self, state: MissionState) -> bool:
        """Whether the mission is in a state."""
        return self.snapshot.state is state

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, by its odometry."""
        twist = self.snapshot.measured
        return hypot(twist.linear, twist.lateral) >= MOVING_SPEED or (
            abs(twist.angular) >= MOVING_SPEED
        )

    @property
    def is_lost(self) -> bool:
        """Whether the localisation is lost."""
        return self.snapshot.health < self.snapshot.health_thresholds.lost

    @property
    def is_stopped_for_good(self) -> bool:
        """Whether the emergency stop is engaged after the end of the mission."""
        return self.snapshot.state.is_over and any(
            limitation.cause == EMERGENCY_STOP for limitation in self.snapshot.limitations
        )

    @property
    def is_recovering(self) -> bool:
        """Whether a recovery of a `recover` modifier runs: any of its children but the first."""
        recovers = {row.id: True for row in self.snapshot.tree if row.kind == "recover"}
        for row in self.snapshot.tree:
            if row.parent in recovers:
                if not recovers[row.parent] and row.status == "running":
                    return True
                recovers[row.parent] = False
        return False


Row = tuple[str, str, Callable[[Situation], bool]]

S = MissionState

HEADERS: tuple[Row, ...] = (
    ("✘ INCOMPATIBLE ENGINE", "bad", lambda now: bool(now.link.trouble)),
    ("■ OVER, EMERGENCY STOP ENGAGED", "bad", lambda now: now.is_stopped_for_good),
    ("✔ SUCCESS", "good", lambda now: now.is_in(S.SUCCESS)),
    ("✘ FAILURE", "bad", lambda now: now.is_in(S.FAILURE)),
    ("⊘ ABORTED", "warn", lambda now: now.is_in(S.ABORTED)),
    ("⊘ INTERRUPTED", "warn", lambda now: now.is_in(S.INTERRUPTED)),
    ("✘ ERROR", "bad", lambda now: now.is_in(S.ERROR)),
    ("⊘ ENDED", "busy", lambda now: now.link.is_over and now.link.has_report),
    ("✘ ENGINE CRASHED", "bad", lambda now: now.link.is_over),
    ("✘ ENGINE LOST", "bad", lambda now: now.link.is_lost(now.snapshot)),
    ("▲ ENGINE NOT ANSWERING", "warn", lambda now: now.link.silent_for > STALE_AFTER),
    ("■ STOP NOT CONFIRMED", "bad", lambda now: now.link.stop_unconfirmed),
    (
        "■ EMERGENCY STOP, BRAKING", "bad",
        lambda now: now.is_in(S.EMERGENCY_STOP) and now.is_moving,
    ),
    ("■ EMERGENCY STOP, STANDING", "bad", lambda now: now.is_in(S.EMERGENCY_STOP)),
    ("⚑ OPERATOR'S DETOUR (mission paused)", "warn", lambda now: now.snapshot.detour),
    ("‖ YOUR GOAL IS PAUSED", "warn", lambda now: now.snapshot.detour_held and not now.is_moving),
    (
        "● STOPPED AT BREAKPOINT", "warn",
        lambda now: now.is_in(S.PAUSED) and bool(now.snapshot.debugging.held),
    ),
    ("‖ PAUSED, BRAKING", "warn", lambda now: now.is_in(S.PAUSED) and now.is_moving),
    ("‖ PAUSED", "warn", lambda now: now.is_in(S.PAUSED)),
    ("◆ WAITING FOR YOU TO DRIVE", "warn", lambda now: now.snapshot.teleop and not now.is_moving),
    ("◆ YOU ARE DRIVING", "busy", lambda now: now.snapshot.teleop),
    ("▲ LOST, RECOVERING", "warn", lambda now: now.is_lost and now.is_recovering),
    ("▲ LOST", "warn", lambda now: now.is_lost and now.is_in(S.RUNNING)),
    ("✚ RECOVERING", "warn", lambda now: now.is_recovering),
    ("◌ STARTING", "busy", lambda now: now.is_in(S.STARTING)),
    ("▶ RUNNING", "busy", lambda now: True),
)  # fmt: skip
"""Words, tone and condition of each header; the first whose condition holds is shown."""


def header(snapshot: Snapshot | None, link: Link) -> Header:
    """Return the header of a situation."""
    if snapshot is None:
        return _without_snapshot(link)
    now = Situation(snapshot, link)
    words, tone = next((words, tone) for words, tone, applies in HEADERS if applies(now))
    alarms = []
    if now.is_lost and "LOST" not in words and not snapshot.state.is_over:
        alarms.append("LOST")
    if snapshot.records_lost:
        alarms.append("RECORDS LOST")
    return Header(words, tone, tuple(alarms))


def _without_snapshot(link: Link) -> Header:
    if link.trouble:
        return Header("✘ INCOMPATIBLE ENGINE", "bad")
    if link.is_over:
        return Header("⊘ ENDED", "busy") if link.has_report else Header("✘ ENGINE CRASHED", "bad")
    if link.is_lost(None):
        return Header("✘ NO ENGINE ANSWERS", "bad")
    return Header("◌ WAITING FOR THE ENGINE", "busy")
