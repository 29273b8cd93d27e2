"""Watch on lidars, sonars and the IMU: tells when one delivers nothing, or works again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from stack.drivetrain.description import RobotDescription
from stack.types import Observation

SILENT_PERIODS = 5
"""Missed measurements after which a sensor is silent."""

SILENT_AFTER = 1.0
"""Seconds that a sensor is silent at least before it is reported."""


class SensorEvent(NamedTuple):
    """A sensor or a camera fails, or works again.

    Attributes:
        sensor: its name.
        fault: `silent`, `dropped`, `frozen`, or as `CameraState.fault`; empty when it works again.
        text: a sentence for people.
    """

    sensor: str
    fault: str
    text: str


class SensorWatch:
    """Watches the sensors of a robot that measure all the time."""

    def __init__(self, robot: RobotDescription) -> None:
        rates = {name: lidar.rate for name, lidar in robot.real_lidars.items()}
        rates |= {name: sonar.rate for name, sonar in robot.sonars.items()}
        if robot.imu is not None:
            rates["imu"] = robot.imu.rate
        self._rates = rates
        self._heard: dict[str, float] = {}
        self._silent: set[str] = set()
        self._dropping: set[str] = set()

    def update(self, observation: Observation, dropped: Mapping[str, int]) -> list[SensorEvent]:
        """Return what has changed.

        Args:
            observation: the measurements that are used.
            dropped: number of unused scans by sensor.
        """
        events = [self._first_dropped(name) for name in dropped if name not in self._dropping]
        now = observation.time
        for name, rate in self._rates.items():
            since = now - self._heard.setdefault(name, now)
            if name in observation.measurements:
                self._heard[name] = now
                if name in self._silent:
                    self._silent.remove(name)
                    events.append(SensorEvent(name, "", f"the sensor {name} works again"))
            elif since > max(SILENT_AFTER, SILENT_PERIODS / rate) and name not in self._silent:
                self._silent.add(name)
                text = f"the sensor {name} has delivered nothing usable for {since:.1f} s"
                events.append(SensorEvent(name, "silent", f"{text}; its rate is {rate:g} Hz"))
        return events

    def silence(self, now: float) -> dict[str, float]:
        """Seconds up to a time of the robot's clock for which each silent sensor was not heard."""
        return {name: now - self._heard[name] for name in sorted(self._silent)}

    def _first_dropped(self, name: str) -> SensorEvent:
        self._dropping.add(name)
        text = (
            f"a scan of {name} is not used: the odometry does not cover it, or a newer one is "
            "there; all such scans are counted in the report"
        )
        return SensorEvent(name, "dropped", text)
