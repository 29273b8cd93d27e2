"""An arm of a simulated robot: follows trajectories, stops, and measures its joints.

A stop slows the time along the trajectory down, so that the arm stays on its way and can go on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stack.body import DEAD_MAN, BodyCommand
from stack.drivetrain.arm_description import HOME, ArmDescription
from stack.sim.physics.engine import PhysicsArm
from stack.sim.rates import PHYSICS_PERIOD
from stack.types import FloatArray, GripperState, JointState, JointTrajectory

TRACKING_ERROR = 0.1
"""Difference between wanted and measured position at which the arm stops by itself, rad or m."""

RESTING_SPEED = 1e-3
"""Speed of a finger below which it stands, m/s."""


class JointTargets(NamedTuple):
    """What joints strive for: positions and velocities, each (n,)."""

    positions: FloatArray
    velocities: FloatArray


def targets_at(trajectory: JointTrajectory, time: float) -> JointTargets:
    """Return where a trajectory is at a time, seconds since its begin: cubic Hermite pieces.

    Before the begin it is at the first row, after the end at rest at the last one.
    """
    times, positions, velocities = trajectory.times, trajectory.positions, trajectory.velocities
    if time >= times[-1]:
        return JointTargets(positions[-1], np.zeros_like(velocities[-1]))
    after = int(np.clip(np.searchsorted(times, time, side="right"), 1, len(times) - 1))
    begin, span = float(times[after - 1]), float(times[after] - times[after - 1])
    u = max(0.0, (time - begin) / span)
    p0, p1 = positions[after - 1], positions[after]
    m0, m1 = span * velocities[after - 1], span * velocities[after]
    place = (
        (2 * u**3 - 3 * u**2 + 1) * p0 + (u**3 - 2 * u**2 + u) * m0
        + (3 * u**2 - 2 * u**3) * p1 + (u**3 - u**2) * m1
    )  # fmt: skip
    slope = (
        6 * (u**2 - u) * p0 + (3 * u**2 - 4 * u + 1) * m0
        + 6 * (u - u**2) * p1 + (3 * u**2 - 2 * u) * m1
    )  # fmt: skip
    return JointTargets(place, slope / span)


class SimulatedArm:
    """Drives an arm in the physics.

    Args:
        description: of the arm.
        physics: its motors.
    """

    def __init__(self, description: ArmDescription, physics: PhysicsArm) -> None:
        self._description, self._physics = description, physics
        limits = description.limits
        self._braking_time = float((limits.velocity / limits.acceleration).max())
        self.restart()

    def restart(self) -> None:
        """Begin again; the physics has the arm at its first posture already."""
        self._trajectory: JointTrajectory | None = None
        self._time, self._rate = 0.0, 0.0  # along the trajectory, and its share of real time
        self._runs, self._ends = False, False
        self._silence, self._problem = 0.0, ""
        home = self._description.postures[HOME]
        self._targets = JointTargets(home, np.zeros_like(home))

    def command(self, command: BodyCommand) -> None:
        """Begin, hold, continue or end a motion."""
        self._silence = 0.0
        ends = command.emergency_stop or command.stop_arm
        if command.trajectory is not None and not ends:
            self._trajectory, self._time, self._problem = command.trajectory, 0.0, ""
            self._rate = 1.0
            self._ends = False
        self._runs = not (ends or command.hold_arm)
        self._ends = self._ends or ends
        if command.gripper is not None and not command.emergency_stop:
            self._physics.move_fingers(command.gripper.width, command.gripper.force)

    @property
    def is_moving(self) -> bool:
        """Whether the next physics step changes what the joints strive for."""
        return self._trajectory is not None and (self._rate > 0.0 or self._wants_to_run)

    def advance(self) -> None:
        """Set what the joints strive for in the next physics step."""
        trajectory = self._trajectory
        if trajectory is None:
            return
        self._silence += PHYSICS_PERIOD
        change = PHYSICS_PERIOD / self._braking_time
        wanted = 1.0 if self._wants_to_run else 0.0
        self._rate += min(change, max(-change, wanted - self._rate))
        self._time += self._rate * PHYSICS_PERIOD
        place, slope = targets_at(trajectory, self._time)
        self._targets = JointTargets(place, self._rate * slope)
        self._physics.drive(place.tolist(), (self._rate * slope).tolist())
        if self._time >= trajectory.duration or (self._ends and self._rate == 0.0):
            self._trajectory, self._rate = None, 0.0

    def state(self, time: float) -> JointState:
        """Return the measured joints; an arm that cannot follow stops where it is."""
        positions, velocities, efforts = self._physics.joints()
        self._watch(positions)
        return JointState(time, positions, velocities, efforts, self._problem)

    def gripper_state(self, time: float) -> GripperState | None:
        """Return the measured gripper; None without one."""
        if self._description.gripper is None:
            return None
        width, speed, force = self._physics.finger_state()
        return GripperState(time, width, force, speed > RESTING_SPEED)

    @property
    def positions(self) -> dict[str, float]:
        """True positions of the joints of arm and gripper, by name."""
        described = self._description
        found = dict(zip(described.joints, self._physics.joints().positions.tolist(), strict=True))
        if described.gripper is not None:
            half = self._physics.finger_state().width / 2.0
            found |= dict.fromkeys(described.gripper.joints, half)
        return found

    @property
    def _wants_to_run(self) -> bool:
        return self._runs and not self._ends and self._silence <= DEAD_MAN

    def _watch(self, positions: FloatArray) -> None:
        error = np.abs(positions - self._targets.positions)
        worst = int(error.argmax())
        if error[worst] <= TRACKING_ERROR or self._problem:
            return
        name = self._description.joints[worst]
        self._problem = f"{name}: it is {error[worst]:.2f} from where it should be"
        self._trajectory, self._rate = None, 0.0
        self._targets = JointTargets(positions, np.zeros_like(positions))
        self._physics.drive(positions.tolist(), [0.0] * len(positions))
