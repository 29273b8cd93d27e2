"""Battery, localisation, speed, counters and the compute time of each stage."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static

from stack.telemetry.records import Snapshot
from tui.palette import BAD, BUSY, DIM, FAINT, GOOD, PARTICLE, TEXT, WARN, css

BAR = 10
STAGES = ("estimate", "costmap", "tree", "navigate", "safety", "body")


class VitalsPane(Static, can_focus=True):
    """Figures that an operator glances at."""

    BORDER_TITLE = "Vitals"

    def __init__(self) -> None:
        super().__init__(id="vitals")

    def show(self, snapshot: Snapshot) -> None:
        """Show the figures of a snapshot."""
        text = Text()
        self._battery(text, snapshot)
        self._localisation(text, snapshot)
        self._line(
            text, "speed",
            f"{snapshot.measured.linear:5.2f} m/s  {snapshot.measured.angular:5.2f} rad/s",
        )  # fmt: skip
        counters = snapshot.counters
        self._line(
            text, "driven",
            f"{counters.get('distance', 0):.1f} m  recov {counters.get('recoveries', 0):.0f}"
            f"  replans {counters.get('replans', 0):.0f}",
        )  # fmt: skip
        if snapshot.truth is not None:
            error = snapshot.pose.distance_to(snapshot.truth)
            clearance = counters.get("clearance")
            near = f"  nearest {clearance:.2f} m" if clearance is not None else ""
            self._line(text, "true", f"off by {error * 100:.1f} cm{near}")
        if snapshot.safety:
            text.append(f"safety   {snapshot.safety}\n", style=css(WARN))
        self._stages(text, snapshot)
        self.update(text)

    def _line(self, text: Text, label: str, value: str) -> None:
        text.append(f"{label:<9}", style=css(DIM))
        text.append(f"{value}\n", style=css(TEXT))

    def _bar(self, text: Text, share: float, colour: int) -> None:
        filled = round(max(0.0, min(1.0, share)) * BAR)
        text.append("━" * filled, style=css(colour))
        text.append("━" * (BAR - filled), style=css(FAINT))

    def _battery(self, text: Text, snapshot: Snapshot) -> None:
        charge = snapshot.battery.charge
        colour = GOOD if charge > 0.4 else WARN if charge > 0.2 else BAD
        text.append(f"{'battery':<9}", style=css(DIM))
        self._bar(text, charge, colour)
        flash = " ⚡" if snapshot.battery.charging else ""
        text.append(f" {charge:.0%}{flash}\n", style=css(colour))

    def _localisation(self, text: Text, snapshot: Snapshot) -> None:
        quality = snapshot.quality
        colour = GOOD if quality > 0.5 else WARN if quality >= 0.3 else BAD
        deviation = float(snapshot.covariance[:2, :2].trace()) ** 0.5
        text.append(f"{'fit':<9}", style=css(DIM))
        self._bar(text, quality, colour)
        text.append(f" {quality:.2f} ±{deviation * 100:.0f} cm\n", style=css(colour))

    def _stages(self, text: Text, snapshot: Snapshot) -> None:
        for name in STAGES:
            stage = snapshot.stages.get(name)
            if stage is None:
                continue
            text.append(f"{name:<9}", style=css(DIM))
            self._bar(text, stage.mean / 0.010, PARTICLE if name != "body" else BUSY)
            late = f" ▲{stage.overruns}" if stage.overruns else ""
            text.append(f" {stage.mean * 1e3:5.2f} ms{late}\n", style=css(WARN if late else TEXT))
