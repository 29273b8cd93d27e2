"""Battery model: drains with time and speed, charges on a dock."""

from __future__ import annotations

from math import hypot

from stack.body import GroundTruth
from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import Dock
from stack.types import Battery as BatteryReading

STANDSTILL_SPEED = 0.05
"""Speed, m/s and rad/s, below which a robot on a dock charges."""

START_CHARGE = 1.0
"""Battery charge at the start, 0 to 1."""

JOULES_PER_WATT_HOUR = 3600.0


class Battery:
    """State of charge from an energy balance; the voltage is linear in the charge."""

    def __init__(self, robot: RobotDescription, docks: tuple[Dock, ...]) -> None:
        self._description, self._limits, self._docks = robot.battery, robot.limits, docks
        self._front = robot.footprint.front
        self.charge, self._charging = START_CHARGE, False

    def update(self, truth: GroundTruth, period: float) -> None:
        """Advance by `period` seconds at the robot's pose and speed."""
        d = self._description
        self._charging = self._on_dock(truth)
        power = d.charge_power if self._charging else -d.idle_power - self._drive_power(truth)
        change = power * period / (d.capacity * JOULES_PER_WATT_HOUR)
        self.charge = min(1.0, max(0.0, self.charge + change))

    def reading(self, time: float) -> BatteryReading:
        """Return the measurement that the robot receives at a time in seconds."""
        d = self._description
        voltage = d.voltage_empty + self.charge * (d.voltage_full - d.voltage_empty)
        return BatteryReading(self.charge, self._charging, voltage, time)

    def _drive_power(self, truth: GroundTruth) -> float:
        share = abs(truth.twist.linear) / self._limits.linear_speed
        if self._limits.lateral_speed > 0.0:
            share = hypot(share, truth.twist.lateral / self._limits.lateral_speed)
        turning = abs(truth.twist.angular) / self._limits.angular_speed
        return self._description.drive_power * min(1.0, max(share, turning))

    def _on_dock(self, truth: GroundTruth) -> bool:
        twist = truth.twist
        if max(abs(twist.linear), abs(twist.lateral), abs(twist.angular)) > STANDSTILL_SPEED:
            return False
        return any(dock.charges(truth.pose, self._front) for dock in self._docks)
