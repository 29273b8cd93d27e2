"""Checks of a rover before it drives: each with a name, its answer, and what to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from robots.mavlink.autopilots import ARDUROVER, PX4_ROVER
from robots.mavlink.hearing import Hearing, Rover
from robots.mavlink.measurements import Measurements
from robots.mavlink.parameters import MavlinkParameters

OLDEST_ODOMETRY = 1.0
"""Seconds without odometry after which there is none."""

BATTERY_WITHIN = 3.0
"""Seconds in which an autopilot that knows its charge has told it, once a second."""

LONGEST_LOSS = 1.0
"""Seconds without setpoints after which PX4 should stop at the latest."""


@dataclass(frozen=True, slots=True)
class Check:
    """One check.

    Attributes:
        name: of the check.
        passed: whether the rover may drive; a check that cannot be made passes and says so.
        text: what was found.
        remedy: what to do; also of a passed check, if something could be better.
    """

    name: str
    passed: bool
    text: str
    remedy: str = ""

    def __str__(self) -> str:
        hint = f"; {self.remedy}" if self.remedy else ""
        return f"{'✔' if self.passed else '✘'} {self.name}: {self.text}{hint}"


@dataclass(frozen=True, slots=True)
class Subject:
    """What is checked.

    Attributes:
        heard: what the rover has told.
        problem: of the link; empty if the rover is heard.
        measurements: that have come so far.
        parameters: of the body.
        now: seconds on the clock of the link.
        known_for: seconds since the rover was found.
    """

    heard: Hearing
    problem: str
    measurements: Measurements
    parameters: MavlinkParameters
    now: float
    known_for: float


def checks_of(subject: Subject) -> list[Check]:
    """All checks in order; without a rover only the first."""
    rover = subject.heard.rover
    if rover is None:
        return [
            Check("heartbeat", False, subject.problem, "is the rover on, and is this its address?")
        ]
    return [make(subject, rover) for make in _CHECKS]


def _heartbeat(subject: Subject, rover: Rover) -> Check:
    problem = subject.problem if subject.now - rover.heard > OLDEST_ODOMETRY else ""
    found = f"system {rover.system}, {rover.autopilot.name}, mode {rover.mode}"
    return Check("heartbeat", not problem, problem or found, "is the rover on?" if problem else "")


def _alone(subject: Subject, rover: Rover) -> Check:
    others = sorted(subject.heard.others)
    if subject.parameters.system == 0 and others:
        systems = ", ".join(map(str, [rover.system, *others]))
        return Check(
            "one rover", False, f"several rovers are there: {systems}", "set `system` of the body"
        )
    return Check("one rover", True, f"system {rover.system}")


def _signature(subject: Subject, rover: Rover) -> Check:
    if subject.parameters.key:
        return Check("signature", True, "the key of the body")
    if rover.signs:
        return Check(
            "signature", False, "the rover signs its frames and refuses ours",
            "set `key` of the body to the file with its key",
        )  # fmt: skip
    return Check("signature", True, "none: everybody who reaches the address can drive the rover")


def _odometry(subject: Subject, rover: Rover) -> Check:
    measurements = subject.measurements
    heard, needs = measurements.odometry.heard, measurements.source
    if heard is None or subject.now - heard > OLDEST_ODOMETRY:
        since = "none yet" if heard is None else f"none for {subject.now - heard:.1f} s"
        return Check(
            "odometry", False, f"{needs}: {since}",
            "the autopilot has no position estimate yet; see its messages",
        )  # fmt: skip
    return Check("odometry", True, f"from {needs}")


def _battery(subject: Subject, rover: Rover) -> Check:
    battery, least = subject.measurements.battery, subject.parameters.least_charge
    if battery is None and subject.known_for < BATTERY_WITHIN:
        return Check("battery", False, "not told yet")
    if battery is None:
        return Check("battery", True, "the autopilot does not tell its charge")
    text = f"{battery.charge:.0%}, {battery.voltage:.1f} V"
    if battery.charge < least:
        return Check("battery", False, text, f"charge it above {least:.0%} (`least_charge`)")
    return Check("battery", True, text)


def _watchdog(subject: Subject, rover: Rover) -> Check:
    """Whether the rover stops by itself when treepilot, its computer or the link fails."""
    name, values, autopilot = "setpoint watchdog", subject.heard.values, rover.autopilot
    if autopilot is PX4_ROVER:
        loss = values.get("COM_OF_LOSS_T")
        if loss is None:
            return Check(name, True, "COM_OF_LOSS_T cannot be read")
        fits = loss <= LONGEST_LOSS
        remedy = "" if fits else f"set COM_OF_LOSS_T to {LONGEST_LOSS:g} s or less"
        return Check(name, fits, f"it stops after {loss:g} s without a setpoint", remedy)
    text = f"it stops after {autopilot.stops_after}"
    enabled = values.get("FS_GCS_ENABLE")
    station = values.get("MAV_GCS_SYSID", values.get("SYSID_MYGCS"))
    own = subject.parameters.own_system
    if autopilot is ARDUROVER and enabled == 0:
        remedy = f"FS_GCS_ENABLE 1 and MAV_GCS_SYSID {own} let it also go to HOLD"
        return Check(name, True, text, remedy)
    if enabled and station is not None and station != own:
        remedy = f"its failsafe watches system {station:g}: set MAV_GCS_SYSID to {own}"
        return Check(name, True, text, remedy)
    return Check(name, True, text)


def _mode(subject: Subject, rover: Rover) -> Check:
    wanted = rover.autopilot.driving
    if rover.mode == wanted:
        return Check("mode", True, wanted)
    text = f"{rover.mode}, and {wanted} is not accepted"
    return Check("mode", False, text, _words(subject.heard))


def _armed(subject: Subject, rover: Rover) -> Check:
    if rover.armed:
        return Check("armed", True, "yes")
    return Check("armed", False, "the autopilot refuses", _words(subject.heard))


def _words(heard: Hearing) -> str:
    """The autopilot's own words about its refusal."""
    said = heard.last_text
    return f"it says: {said}" if said else "it does not say why"


_CHECKS: tuple[Callable[[Subject, Rover], Check], ...] = (
    _heartbeat, _alone, _signature, _odometry, _battery, _watchdog, _mode, _armed,
)  # fmt: skip

LAST = ("mode", "armed")
"""Checks that can only pass once the body has asked for control."""
