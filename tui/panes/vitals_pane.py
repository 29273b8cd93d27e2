"""Vitals pane: battery, localisation, speed, counters and the compute time of each stage."""

from __future__ import annotations

from math import isfinite, nan

from rich.markup import escape
from rich.text import Text

from stack.telemetry.records import RunInfo, Snapshot
from stack.types import ArmView
from tui.drawing.palette import (
    BAD,
    BUSY,
    DIM,
    FAINT,
    PARTICLE,
    TEXT,
    WARN,
    charge_colour,
    css,
    health_colour,
)
from tui.drawing.strips import TextLines, one_line

BAR, LABEL = 10, 9
LEVELS = "▁▂▃▄▅▆▇█"
"""From the lower to the upper limit of a joint."""

STAGES = ("estimate", "costmap", "tree", "navigate", "safety", "body")

USABLE_FAULTS = ("late", "uniform")
"""Faults of cameras whose pictures are used nevertheless."""

FULL_BAR = 0.010
"""Compute time of a full bar, seconds: a fifth of the control period at 20 Hz."""


class VitalsPane(TextLines, can_focus=True):
    """Shows the vital figures of the robot and the engine."""

    BORDER_TITLE = "Vitals"

    def __init__(self) -> None:
        super().__init__(id="vitals")
        self._shown = Text("waiting for the robot", style=f"italic {css(DIM)}")
        self._warning = ""

    def show(
        self, snapshot: Snapshot, info: RunInfo | None = None, true_speed: float = nan
    ) -> None:
        """Show the figures of a snapshot; of a robot without wheels, none of driving.

        Args:
            snapshot: to show.
            info: of its run.
            true_speed: of the truth, m/s; NaN: unknown.
        """
        text = Text(no_wrap=True, overflow="ellipsis")
        drives = info is None or info.drives
        self._battery(text, snapshot)
        if drives:
            self._localisation(text, snapshot)
            speed = snapshot.measured
            _line(text, "wheels", f"{speed.linear:5.2f} m/s  {speed.angular:+.2f} rad/s")
        if snapshot.arm is not None:
            arm_lines(text, snapshot.arm)
        _cameras(text, snapshot)
        if drives:
            self._counters(text, snapshot)
            _truth(text, snapshot, true_speed)
        else:
            _hits(text, snapshot)
        self._stages(text, snapshot)
        text.right_crop(1)
        warning = (
            f"[{css(WARN)}]▲ {escape(one_line(snapshot.safety))}[/]" if snapshot.safety else ""
        )
        if warning != self._warning:
            self.border_subtitle = self._warning = warning
        if text != self._shown:
            self._shown = text
            self.put_text(text)

    def on_resize(self) -> None:
        """Use the new width."""
        self.put_text(self._shown)

    def _battery(self, text: Text, snapshot: Snapshot) -> None:
        charge = snapshot.battery.charge
        colour = charge_colour(charge)
        charging = " charging" if snapshot.battery.charging else ""
        _bar(text, "battery", charge, colour)
        text.append(f" {charge:.0%}{charging}\n", style=css(colour))

    def _localisation(self, text: Text, snapshot: Snapshot) -> None:
        health = snapshot.health
        colour = health_colour(health, snapshot.health_thresholds)
        deviation = float(snapshot.covariance[:2, :2].trace()) ** 0.5
        _bar(text, "health", health, colour)
        text.append(f" {health:.2f} ±{deviation * 100:.0f} cm\n", style=css(colour))
        if snapshot.old_scan:
            _line(text, "scan", f"{snapshot.old_scan:.1f} s old", WARN)
        if snapshot.rivals:
            nearest = min(snapshot.pose.distance_to(rival.pose) for rival in snapshot.rivals)
            shares = " ".join(f"{rival.share:.0%}" for rival in snapshot.rivals[:3])
            _line(text, "rivals", f"{len(snapshot.rivals)}: {shares}, from {nearest:.1f} m", WARN)

    def _counters(self, text: Text, snapshot: Snapshot) -> None:
        counters = snapshot.counters
        clearance = counters.get("clearance")
        near = f"  nearest {clearance:.2f} m" if clearance is not None else ""
        _line(text, "driven", f"{counters.get('distance', 0.0):5.1f} m{near}")
        collisions = int(counters.get("collisions", 0))
        _line(
            text, "recovery", f"{counters.get('recoveries', 0):3.0f}×  replans"
            f" {counters.get('replans', 0):.0f}  hits {collisions}", BAD if collisions else TEXT,
        )  # fmt: skip

    def _stages(self, text: Text, snapshot: Snapshot) -> None:
        for name in STAGES:
            stage = snapshot.stages.get(name)
            if stage is None:
                continue
            _bar(text, name, stage.mean / FULL_BAR, PARTICLE if name != "body" else BUSY)
            text.append(f" {stage.mean * 1e3:5.2f} ms", style=css(TEXT))
            text.append(f" ▲{stage.overruns}\n" if stage.overruns else "\n", style=css(WARN))


def _truth(text: Text, snapshot: Snapshot, speed: float) -> None:
    """Show the true speed of a simulated robot, and how far its pose is wrong."""
    if snapshot.truth is None:
        return
    error = snapshot.pose.distance_to(snapshot.truth)
    fast = f"{speed:5.2f} m/s" if isfinite(speed) else "    -    "
    _line(text, "truth", f"{fast}  {error * 100:.1f} cm off")


def _hits(text: Text, snapshot: Snapshot) -> None:
    recoveries, hits = (int(snapshot.counters.get(key, 0)) for key in ("recoveries", "collisions"))
    _line(text, "recovery", f"{recoveries:3}×  hits {hits}", BAD if hits else TEXT)


def arm_lines(text: Text, arm: ArmView) -> None:
    """Show where each joint is between its limits, the tool in the base frame, and the gripper."""
    shares = (arm.positions - arm.lower) / (arm.upper - arm.lower)
    steps = [round(max(0.0, min(1.0, float(share))) * (len(LEVELS) - 1)) for share in shares]
    state = one_line(arm.problem) if arm.problem else "moving" if arm.moving else "at rest"
    colour = BAD if arm.problem else TEXT
    _line(text, "arm", f"{''.join(LEVELS[step] for step in steps)} {state}", colour)
    x, y, z = arm.tool[:3, 3]
    _line(text, "tool", f"{x:.2f} {y:+.2f} {z:.2f} m")
    if arm.width_max:
        _bar(text, "gripper", arm.width / arm.width_max, PARTICLE)
        text.append(f" {1e3 * arm.width:.0f} mm {arm.force:.0f} N\n", style=css(TEXT))


def _cameras(text: Text, snapshot: Snapshot) -> None:
    """Show the cameras that are on or faulty: the age of the newest picture, or the fault."""
    label = "cameras"
    for camera in snapshot.cameras:
        if not camera.is_on and not camera.fault:
            continue
        age = f"{camera.age:.2f} s old" if isfinite(camera.age) else "no picture yet"
        colour = WARN if camera.fault in USABLE_FAULTS else BAD if camera.fault else TEXT
        fault = f"{camera.fault}, " if camera.fault else ""
        _line(text, label, f"{one_line(camera.name)}: {fault}{age}", colour)
        label = ""


def _line(text: Text, label: str, value: str, colour: int = TEXT) -> None:
    text.append(label.ljust(LABEL), style=css(DIM))
    text.append(f"{value}\n", style=css(colour))


def _bar(text: Text, label: str, share: float, colour: int) -> None:
    filled = round(max(0.0, min(1.0, share)) * BAR)
    text.append(label.ljust(LABEL), style=css(DIM))
    text.append("━" * filled, style=css(colour))
    text.append("━" * (BAR - filled), style=css(FAINT))
