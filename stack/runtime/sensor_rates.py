"""How often each sensor delivers, against the rate that the robot file states."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from math import inf

from stack.drivetrain.description import RobotDescription
from stack.perception.cameras.watch import COLOUR_CAMERA
from stack.types import Imu, Observation, SensorState

WINDOW = 5.0
"""Seconds of the robot's clock over which a rate is counted."""


class SensorRates:
    """Counts the measurements of the last seconds.

    Args:
        robot: its description.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._expected = {name: lidar.rate for name, lidar in robot.real_lidars.items()}
        self._expected |= {name: sonar.rate for name, sonar in robot.sonars.items()}
        if robot.imu is not None:
            self._expected["imu"] = robot.imu.rate
        self._cameras = {name: camera.rate for name, camera in robot.depth_cameras.items()}
        if robot.camera is not None:
            self._cameras[COLOUR_CAMERA] = robot.camera.rate
        self._heard: dict[str, deque[tuple[float, int]]] = {}
        self._counts: dict[str, int] = {}
        self._begin = inf

    def update(self, observation: Observation) -> None:
        """Count the measurements of a step."""
        self._begin = min(self._begin, observation.time)
        for name, measured in observation.measurements.items():
            count = len(measured.stamps) if isinstance(measured, Imu) else 1
            self._heard.setdefault(name, deque()).append((observation.time, count))
            self._counts[name] = self._counts.get(name, 0) + count
        for name, heard in self._heard.items():
            while heard and heard[0][0] <= observation.time - WINDOW and len(heard) > 1:
                self._counts[name] -= heard.popleft()[1]

    def states(self, now: float, cameras_on: Collection[str]) -> tuple[SensorState, ...]:
        """The sensors at a time of the robot's clock.

        Args:
            now: seconds.
            cameras_on: the cameras whose pictures are requested.
        """
        expected = {**self._expected, **{name: 0.0 for name in self._cameras}}
        expected |= {name: self._cameras[name] for name in cameras_on if name in self._cameras}
        span = max(1e-9, min(WINDOW, now - self._begin))
        return tuple(
            self._state(name, expected.get(name, 0.0), now, span)
            for name in dict.fromkeys((*expected, *self._heard))
        )

    def _state(self, name: str, expected: float, now: float, span: float) -> SensorState:
        heard = self._heard.get(name, ())
        count = self._counts.get(name, 0)
        for time, old in heard:  # the few at the edge of the window
            if time > now - span:
                break
            count -= old
        rate = count / span if len(heard) > 1 else 0.0
        return SensorState(name, rate, expected, now - heard[-1][0] if heard else inf)
