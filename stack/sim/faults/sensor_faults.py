"""What faults of sensors share: which sensor, and how its measurements change."""

from __future__ import annotations

from typing import Any, ClassVar

from stack.drivetrain.description import CAMERA, RobotDescription
from stack.sim.faults.fault import Fault, Measurements
from stack.sim.worlds.world import World

LIDAR, DEPTH, ANY = "lidar", "depth camera", "sensor"


def sensors_of(robot: RobotDescription, what: str) -> list[str]:
    """Return the names of the sensors of a robot: of its lidars, its depth cameras, or all."""
    lidars, depth = list(robot.real_lidars), list(robot.depth_cameras)
    if what != ANY:
        return lidars if what == LIDAR else depth
    cameras = [CAMERA] if robot.camera is not None else []
    imu = ["imu"] if robot.imu is not None else []
    return [*lidars, *robot.sonars, *cameras, *depth, *imu]


class SensorFault(Fault):
    """A fault of one sensor, `parameters.sensor`.

    Attributes:
        what: the sensors it can befall: lidar, depth camera or sensor.
    """

    what: ClassVar[str] = LIDAR

    @classmethod
    def lack(cls, parameters: Any, robot: RobotDescription, world: World) -> str:
        """Return that the robot has no such sensor."""
        known = sensors_of(robot, cls.what)
        if parameters.sensor in known:
            return ""
        there = f"it has {', '.join(known)}" if known else f"it has no {cls.what}"
        return f"{robot.name} has no {cls.what} {parameters.sensor!r}; {there}"

    def measured(self, measurements: Measurements, time: float) -> Measurements:
        """Return the measurements with the changed one of the sensor."""
        name = self.parameters.sensor
        if name not in measurements:
            return measurements
        return {**measurements, name: self.changed(measurements[name])}

    def changed(self, measurement: Any) -> Any:
        """Return what the sensor delivers instead of a measurement."""
        return measurement
