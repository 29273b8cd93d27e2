"""Body of a robot whose wheels a fast loop holds: a real robot, or emulated wheels."""

from __future__ import annotations

from dataclasses import replace
from time import monotonic, sleep  # noqa: TID251 - the clock of a real-time body

import numpy as np

from robots.motors.odometry import EncoderOdometry
from robots.motors.odrive import CLEAR, SUPPLY, SUPPLY_KIND
from robots.motors.parameters import WheelsParameters
from robots.real_time import RealTimeBody
from robots.sensor_drivers.readers import SensorReaders
from stack.body import (
    DEAD_MAN,
    FAST_LOOP,
    MOTOR,
    BodyCommand,
    BodyHealth,
    Engageable,
    FastLoopBody,
)
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.wheel_loop import (
    ANGLES,
    MEASURED_SPEEDS,
    STAMPS,
    STEERING_MEASURED,
    block,
    loop_plan,
)
from stack.errors import BodyError
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.types import Battery, LoopStatistics, Measurement, Observation

TORQUE_OFF = 2.0
"""Seconds without a command after which the standing wheels are released."""

CLEARS_WITHIN = 0.3
"""Seconds after which a fault that was cleared is one again."""

FIRST_FEEDBACK = 1.0
"""Seconds in which the fast loop must complete its first cycle."""


class WheelsBody(RealTimeBody, FastLoopBody, Engageable):
    """Drives through a fast loop; odometry from its encoders, health from its driver's faults.

    Args:
        description: the robot.
        parameters: of the fast loop and its driver.

    Raises:
        BodyError: the hardware does not respond.
    """

    def __init__(self, description: RobotDescription, parameters: WheelsParameters) -> None:
        name, values = parameters.named_driver
        plan = loop_plan(description.drivetrain, DEAD_MAN, TORQUE_OFF, description.wheel_control)
        self.loop = FastLoop(
            LoopSetup(plan, name, values, parameters.rate, parameters.opens_within)
        )
        super().__init__(description)  # its time begins with the fast loop
        self._odometry = EncoderOdometry(description.drivetrain)
        self._is_stopped, self._cleared = False, float("-inf")
        self._read = 0
        self._await_feedback()
        try:
            self._sensors = SensorReaders(description)
        except BaseException:
            self.loop.close()
            raise

    @property
    def loop_statistics(self) -> LoopStatistics:
        """Timing of the fast loop."""
        return self.loop.statistics()

    def sense(self) -> Observation:
        """Return the wheels' odometry, at the time of its measurement, and what sensors measured.

        While the loop is silent the last pose stands for the present one.

        Raises:
            BodyError: the fast loop has ended.
        """
        if self.loop.has_ended:
            raise BodyError(self.loop.problem)
        wheels = self._odometry.reading
        self._update()
        if self._odometry.reading is wheels:
            self._odometry.reading = replace(wheels, stamp=self.time)
        time = self._odometry.reading.stamp
        measured: dict[str, Measurement] = {"wheels": self._odometry.reading}
        measured |= self._sensors.take(self._began, self._began + time)
        for message in self.loop.messages():
            if len(message) == SUPPLY.size and message[:1] == SUPPLY_KIND:
                measured["battery"] = self._battery(message)
        return Observation(time, measured)

    def command(self, command: BodyCommand) -> None:
        """Hand over the velocity; the loop limits it, and stops without new ones."""
        if command.emergency_stop != self._is_stopped:
            self._is_stopped = command.emergency_stop
            (self.loop.emergency_stop if self._is_stopped else self.loop.release)()
        self.loop.command(command.twist)

    @property
    def health(self) -> BodyHealth:
        """A fast loop that is frozen or has ended, or what its driver reports."""
        if problem := self.loop.problem:
            return BodyHealth(problem, FAST_LOOP)
        fault = self.loop.fault
        if fault and monotonic() - self._cleared >= CLEARS_WITHIN:
            return BodyHealth(fault, MOTOR)
        return BodyHealth(self._sensors.problem)

    def engage(self) -> str:
        """Let the driver forget the faults that stand, and arm the motors again."""
        if self.loop.problem:
            return self.loop.problem
        if self.loop.fault:
            self.loop.send(CLEAR)
            self._cleared = monotonic()
        return ""

    def close(self) -> None:
        """Stop the robot, release the wheels and end the loop. Safe to call twice."""
        self.loop.close()
        self._sensors.close()

    def _battery(self, message: bytes) -> Battery:
        """Return the battery as its driver has measured it."""
        _, at, voltage, _ = SUPPLY.unpack(message)
        charge = self._description.battery.charge_at(voltage)
        return Battery(charge, voltage=voltage, stamp=at - self._began)

    def _await_feedback(self) -> None:
        limit = monotonic() + FIRST_FEEDBACK
        while self.loop.feedback() is None:
            if monotonic() > limit:
                problem = self.loop.problem or f"no cycle within {FIRST_FEEDBACK:g} s"
                self.loop.close()
                raise BodyError(f"the fast loop does not run: {problem}")
            sleep(0.005)
        self._update()

    def _update(self) -> None:
        feedback = self.loop.feedback()
        if feedback is None or feedback.cycle == self._read:
            return
        self._read = feedback.cycle
        state = np.frombuffer(feedback.state)
        stamp = float(block(state, STAMPS).max()) - self._began
        is_steered = bool(self._description.drivetrain.steering_joints)
        angles = state[STEERING_MEASURED : STEERING_MEASURED + 2].tolist() if is_steered else []
        self._odometry.update(
            stamp, block(state, ANGLES).tolist(), block(state, MEASURED_SPEEDS).tolist(), angles
        )
