"""The column of charts: of the base if it moves, of the arm if there is one."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical

from stack.telemetry.records import RunInfo, Snapshot
from tui.drawing import palette
from tui.panes.chart import Chart

SPEEDS = {"wheels": palette.PATH, "true": palette.PERSON, "set": palette.BUSY}
"""Curves of the speed: by the wheels, of the truth in a simulation, and as commanded."""

MOST = 3
"""Charts that are shown at once."""


class RunCharts(Vertical, can_focus=True):
    """The charts of what a run has: the first MOST of them."""

    def __init__(self) -> None:
        super().__init__(id="charts")
        self._speed = Chart("Speed", "m/s", SPEEDS, 0.0, 0.2)
        self._joints = Chart("Joints", "rad/s", {"fastest": palette.BUSY}, 0.0, 0.5)
        self._health = Chart("Localisation", "", {"health": palette.PARTICLE}, 0.0, 1.0)
        self._error = Chart("Pose error", "m", {"error": palette.PERSON}, 0.0, 0.05)
        self._fingers = Chart("Gripper", "mm", {"width": palette.PATH}, 0.0, 20.0)
        self._force = Chart("Grip", "N", {"force": palette.GOAL}, 0.0, 5.0)
        self._all = (
            self._speed, self._joints, self._health, self._fingers, self._error, self._force,
        )  # fmt: skip
        """In the order in which they are shown."""

        for chart in (self._joints, self._fingers, self._force):
            chart.display = False

    def compose(self) -> ComposeResult:
        """Compose all of them, from the top."""
        yield from self._all

    def restart(self) -> None:
        """Forget all samples."""
        for chart in self._all:
            chart.restart()

    def add(
        self, snapshot: Snapshot, info: RunInfo | None, true_speed: float, *, draw: bool
    ) -> None:
        """Add a sample.

        Args:
            snapshot: with the values.
            info: of the run; None: not known yet.
            true_speed: of the truth, m/s; NaN: unknown.
            draw: whether to draw now, or with a later sample.
        """
        shown: dict[Chart, dict[str, float]] = {}
        arm, drives = snapshot.arm, info is None or info.drives
        if drives:
            shown[self._speed] = {
                "wheels": snapshot.measured.linear, "true": true_speed,
                "set": snapshot.commanded.linear,
            }  # fmt: skip
            shown[self._health] = {"health": snapshot.health}
        if drives and snapshot.truth is not None:
            shown[self._error] = {"error": snapshot.pose.distance_to(snapshot.truth)}
        if arm is not None:
            shown[self._joints] = {"fastest": arm.speed}
        if arm is not None and arm.width_max:
            shown[self._fingers] = {"width": 1e3 * arm.width}
            shown[self._force] = {"force": arm.force}
        visible = [chart for chart in self._all if chart in shown][:MOST]
        for chart in self._all:
            chart.display = chart in visible
        for chart, values in shown.items():
            chart.add(snapshot.time, draw=draw and chart in visible, **values)
