"""Scripted robot: a Body for tests. It moves exactly as commanded and measures what a script says.

    def measure(time, pose):
        return {"battery": Battery(0.1 if time > 5.0 else 1.0, stamp=time)}

    body = ScriptedBody(description, measure)
    report = treepilot.run("my_mission.yaml", body=lambda setup: ScriptedBody(setup.robot, measure))

There is no physics: no inertia, no contact and no noise. `scans_of` measures the walls, boxes and
people of a world with the simulated lidars and sonars. `problems` are reported by `health` from
their time on, as a motor that fails. A simulated second takes milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from stack.body import DEAD_MAN, Body, BodyCommand, BodyHealth
from stack.drivetrain.arm_description import HOME, ArmDescription
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved, scaled, share_within_limits
from stack.schedule import Schedule
from stack.sim.arm import targets_at
from stack.sim.scene_state import SceneState
from stack.sim.worlds.world import World
from stack.types import (
    STANDSTILL,
    Battery,
    GripperState,
    JointState,
    JointTrajectory,
    Measurement,
    Observation,
    Odometry,
    Pose2D,
)

Script = Callable[[float, Pose2D], Mapping[str, Measurement]]
"""script(time, pose): measurements at a time (s) and true pose (world frame), by sensor name."""


def nothing_measured(time: float, pose: Pose2D) -> Mapping[str, Measurement]:
    """A script without measurements."""
    return {}


def scans_of(robot: RobotDescription, world: World) -> Script:
    """Return a script of the robot's lidars and sonars in a world: exact, at their own rates.

    People and doors are left out.
    """
    from stack.sim.sensors.lidar import Lidar
    from stack.sim.sensors.sonar import Sonar

    lidars = {
        name: Lidar(replace(lidar, noise=0.0, dropout=0.0, rotation_time=0.0), world, 0, name)
        for name, lidar in robot.real_lidars.items()
    }
    sonars = {
        name: Sonar(replace(sonar, noise=0.0), world, 0, name)
        for name, sonar in robot.sonars.items()
    }
    schedules = {name: Schedule(1.0 / lidar.rate) for name, lidar in robot.real_lidars.items()}
    schedules |= {name: Schedule(1.0 / sonar.rate) for name, sonar in robot.sonars.items()}
    scene = SceneState(doors={door.name: door.closed for door in world.doors})

    def measure(time: float, pose: Pose2D) -> Mapping[str, Measurement]:
        found: dict[str, Measurement] = {}
        for name, schedule in schedules.items():
            if not schedule.take(time):
                continue
            if name in lidars:
                found[name] = lidars[name].scan([(time, pose)], scene, 0, time)
            else:
                found[name] = sonars[name].reading(pose, scene, 0, time)
        return found

    return measure


class IdealArm:
    """An arm that is where its trajectory is, and a gripper that is as wide as commanded.

    Args:
        description: of the arm.
    """

    def __init__(self, description: ArmDescription) -> None:
        self._description = description
        self._trajectory: JointTrajectory | None = None
        self._time, self._holds = 0.0, False
        self._positions = description.postures[HOME]
        self._velocities = np.zeros_like(self._positions)
        self._width = 0.0 if description.gripper is None else description.gripper.width_max

    def command(self, command: BodyCommand) -> None:
        """Begin, hold, continue or end a motion."""
        if command.trajectory is not None:
            self._trajectory, self._time = command.trajectory, 0.0
        if command.emergency_stop or command.stop_arm:
            self._trajectory = None
        self._holds = command.hold_arm
        if command.gripper is not None:
            self._width = command.gripper.width

    def advance(self, period: float) -> None:
        """Move for `period` seconds."""
        self._velocities = np.zeros_like(self._positions)
        if self._trajectory is None or self._holds:
            return
        self._time = min(self._time + period, self._trajectory.duration)
        self._positions, self._velocities = targets_at(self._trajectory, self._time)

    def measured(self, time: float) -> dict[str, Measurement]:
        """Return joints and gripper."""
        efforts = np.zeros_like(self._positions)
        joints = JointState(time, self._positions, self._velocities, efforts)
        if self._description.gripper is None:
            return {"joints": joints}
        return {"joints": joints, "gripper": GripperState(time, self._width, 0.0, moving=False)}


class ScriptedBody(Body):
    """Robot with a perfect drive, a perfect arm and scripted measurements.

    Wheel odometry, joints and battery are always measured; the script may replace them. The
    odometry starts at the origin of the odom frame, the arm at its posture `home`.

    Args:
        description: limits and kind of drive.
        script: called once in each control period.
        start: true pose at the beginning, world frame.
        problems: (time, text) of hardware problems, in order; an empty text ends a problem.
    """

    def __init__(
        self, description: RobotDescription, script: Script = nothing_measured, *,
        start: Pose2D = Pose2D(0.0, 0.0),
        problems: Sequence[tuple[float, str]] = (),
    ) -> None:  # fmt: skip
        self._description, self._script, self._problems = description, script, tuple(problems)
        self._start = self.pose = start
        self._time, self._commanded_at = 0.0, 0.0
        self.commands: list[BodyCommand] = []
        self._twist = STANDSTILL
        self._arm = None if description.arm is None else IdealArm(description.arm)

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Seconds since the beginning."""
        return self._time

    @property
    def health(self) -> BodyHealth:
        """The last problem whose time has come."""
        due = [text for time, text in self._problems if time <= self._time + 1e-9]
        return BodyHealth(due[-1] if due else "")

    def sense(self) -> Observation:
        """Return wheel odometry, joints, battery and the script's measurements."""
        measured: dict[str, Measurement] = {"battery": Battery(1.0, stamp=self._time)}
        if self._description.drivetrain.moves:
            odometry = self.pose.relative_to(self._start)
            measured["wheels"] = Odometry(self._time, odometry, self._twist)
        if self._arm is not None:
            measured |= self._arm.measured(self._time)
        return Observation(self._time, measured | dict(self._script(self._time, self.pose)))

    def command(self, command: BodyCommand) -> None:
        """Drive a velocity, within the limits of speed; all commands are kept in `commands`."""
        self.commands.append(command)
        self._commanded_at = self._time
        twist = self._description.drivetrain.feasible(command.twist)
        self._twist = scaled(twist, share_within_limits(twist, self._description.limits))
        if self._arm is not None:
            self._arm.command(command)

    def wait(self, period: float) -> None:
        """Move for `period` seconds; stop when the last command is too old."""
        is_stale = self._time - self._commanded_at > DEAD_MAN + 1e-9
        if is_stale:
            self._twist = STANDSTILL
        if self._arm is not None and not is_stale:
            self._arm.advance(period)
        self.pose = self.pose.compose(moved(self._twist, period))
        self._time = round(self._time + period, 9)

    def close(self) -> None:
        """Nothing to close."""
