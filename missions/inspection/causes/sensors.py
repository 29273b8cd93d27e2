"""Causes in the sensors: silent, late, with wrong stamps."""

from __future__ import annotations

from math import isfinite

import numpy as np

from missions.inspection.causes.cause import CERTAIN, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence
from stack.telemetry.records import Event
from stack.types import FloatArray
from stack.types.limitations import OLD_MEASUREMENT

FRESH = 0.25
"""Seconds of age up to which a scan is fresh: a period, its rotation and a snapshot."""

LATE = 0.5
"""Seconds of age of the scans that explain a failure wholly: no robot drives by them."""

RECENT = 5.0
"""Seconds before the failure in which the age of the scans counts."""


def sensor_silent(evidence: Evidence) -> Cause | None:
    """A sensor delivered nothing, or its last scan again and again."""
    silent = _silent(evidence)
    if not silent:
        return None
    frozen = [event for event in evidence.told("sensor") if event.fields.get("fault") == "frozen"]
    ages = _ages(evidence)
    stops = evidence.held_share(OLD_MEASUREMENT)
    blind = bool(len(ages)) and ages[-1] > 1.0
    facts = (
        *(Fact(event.text, event.time) for event in (*frozen, *silent)),
        *([Fact(f"the newest scan was {ages[-1]:.1f} s old", evidence.end)] if blind else []),
        *evidence.held_facts(OLD_MEASUREMENT),
    )
    alarm = min(event.time for event in silent)
    names = [str(event.fields.get("sensor", event.fields.get("camera"))) for event in silent]
    repeats = {*names} <= {str(event.fields["sensor"]) for event in frozen}
    what = f"{', '.join(names)} repeats its last scan: nothing new" if repeats else "nothing"
    strength = CERTAIN if blind else CERTAIN * max(0.4, stops)
    return Cause(
        "sensor silent", strength * (1.0 - _dropped_share(evidence)),
        f"{what} came from {', '.join(names)} {_newest(evidence, names, alarm)}", facts,
        "check its cable, power and driver; a mission can wait for it or stop, see `treepilot "
        "trace`",
    )  # fmt: skip


def scans_late(evidence: Evidence) -> Cause | None:
    """Scans arrive, but long after they were measured."""
    ages = _ages(evidence)
    age = float(np.median(ages)) if len(ages) else 0.0
    if age <= FRESH or _silent(evidence):
        return None
    facts = (
        Fact(f"scans were {age:.2f} s old (median of the last {RECENT:g} s); fresh up to {FRESH:g}"
             " s", evidence.end),
        *evidence.held_facts(OLD_MEASUREMENT),
    )  # fmt: skip
    return Cause(
        "scans late", CERTAIN * share(age, LATE) * (1.0 - _dropped_share(evidence)),
        "the scans arrive late", facts,
        "look for a slow network or a busy computer between lidar and robot; `safety.stale_after` "
        "is the age at which the robot stops",
    )  # fmt: skip


def age_limit_low(evidence: Evidence) -> Cause | None:
    """Measurements are fresh, and the age at which safety stops the robot is below theirs."""
    ages, stops = _ages(evidence), evidence.held_share(OLD_MEASUREMENT)
    if not stops or not len(ages) or float(np.median(ages)) > FRESH or _silent(evidence):
        return None
    limit = float(evidence.last.parameters.get("safety.stale_after", 0.0))
    facts = (
        Fact(f"safety.stale_after {limit:g} s; scans were {np.median(ages):.2f} s old (median)"),
        *evidence.held_facts(OLD_MEASUREMENT),
    )
    return Cause(
        "setting does not fit", CERTAIN * stops,
        "safety stops the robot for measurements that are as old as they have to be", facts,
        "let `safety.stale_after` be longer than the period of each range sensor",
    )  # fmt: skip


def wrong_stamps(evidence: Evidence) -> Cause | None:
    """Measurements whose stamps do not fit the clock of the robot."""
    report, ages = evidence.story.report, _ages(evidence)
    dropped = (report or {}).get("scans_dropped", {})
    lost = [event for event in evidence.told("sensor") if event.fields.get("fault") == "dropped"]
    ahead = -float(ages.min()) if len(ages) else 0.0
    strength = CERTAIN * max(_dropped_share(evidence), share(ahead, LATE))
    facts = (
        *(Fact(event.text, event.time) for event in lost[:2]),
        *(Fact(f"{count} scans of {name} could not be used") for name, count in dropped.items()),
        *([Fact(f"a scan was stamped {ahead:.2f} s in the future")] if ahead > 0.05 else []),
    )
    if not facts:
        return None
    return Cause(
        "stamps wrong", strength, "the stamps of the measurements do not fit the robot's clock",
        facts, "synchronise the clocks of sensor and robot; stamps count in seconds of the robot's "
        "clock, from the middle of the measurement",
    )  # fmt: skip


def _newest(evidence: Evidence, names: list[str], alarm: float) -> str:
    """Say when the newest measurement of the silent sensors came.

    A snapshot may hold an age that is a little old: the earliest of the times since the alarm is
    the right one.
    """
    came = [
        shot.time - sensor.age
        for shot in evidence.shots if shot.time >= alarm
        for sensor in shot.sensors if sensor.name in names and isfinite(sensor.age)
    ]  # fmt: skip
    return f"after {min(came):.1f} s" if came else "at all"


def _silent(evidence: Evidence) -> list[Event]:
    """Return the events of the sensors and cameras that were silent at the failure."""
    newest = {str(event.fields.get("sensor")): event for event in evidence.told("sensor")}
    newest |= {str(event.fields.get("camera")): event for event in evidence.told("camera")}
    return [event for event in newest.values() if event.fields.get("fault") == "silent"]


def _dropped_share(evidence: Evidence) -> float:
    """Return the share of the scans that came before the failure and could not be used."""
    report, stamps = evidence.story.report, _stamps(evidence)
    dropped = max((report or {}).get("scans_dropped", {}).values(), default=0)
    if not dropped:
        return 0.0
    used = len(np.unique(stamps[stamps >= evidence.end - RECENT]))
    return share(dropped, dropped + used)


def _stamps(evidence: Evidence) -> FloatArray:
    """Return the stamp of the newest scan in each snapshot of the last seconds."""
    since = evidence.end - RECENT
    return np.array(
        [shot.scan.stamp for shot in evidence.shots if shot.scan and shot.time >= since]
    )


def _ages(evidence: Evidence) -> FloatArray:
    """Return the age of the newest scan in each snapshot of the last seconds."""
    since = evidence.end - RECENT
    return np.array(
        [shot.time - shot.scan.stamp for shot in evidence.shots if shot.scan and shot.time >= since]
    )


CAUSES = (sensor_silent, scans_late, age_limit_low, wrong_stamps)
