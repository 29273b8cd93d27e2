"""Recovery tasks: motions by odometry and range sensors, for behaviours and for drives."""

from __future__ import annotations

from math import degrees

from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError, ParameterError
from stack.navigation.activities import Activities
from stack.navigation.doubt import LocalisationMonitor
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.drive_tools import DriveTools
from stack.navigation.escape.escape import EscapeGoal
from stack.navigation.parameters import NavigationParameters
from stack.navigation.recoveries import (
    BackUp,
    DriveFor,
    DriveOnHeading,
    RecoveryTools,
    Spin,
    StraightLine,
)
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.navigation.teleoperation import Teleoperation
from stack.types import STANDSTILL, ContactZone, FailureCode, Perceived, Twist


class RecoveryTasks:
    """Begins recoveries; each is a motion task, and cancels the current one.

    Args:
        robot: outline and limits.
        tools: of drives.
        activities: runs the motions.
        monitor: decides what moves while the robot is lost.
    """

    def __init__(
        self, robot: RobotDescription, tools: DriveTools, activities: Activities,
        monitor: LocalisationMonitor,
    ) -> None:  # fmt: skip
        self._robot, self._tools, self._activities = robot, tools, activities
        self._monitor = monitor
        self._state: Perceived | None = None

    def look(self, state: Perceived) -> None:
        """Note what this step has perceived."""
        self._state = state
        self._tools.motions.surroundings.look(state)

    @property
    def _parameters(self) -> NavigationParameters:
        return self._tools.parameters

    @property
    def _motion_tools(self) -> RecoveryTools:
        return self._tools.motions.tools(self._parameters)

    @property
    def _lost(self) -> bool:
        return self._state is None or self._monitor.refuses(self._parameters)

    def spin(
        self, angle: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Turn in place by an angle, positive to the left; a car fails at once."""
        task = self._activities.task(f"spin {degrees(angle):.0f} deg")
        rate = _positive("speed", self._parameters.spin_speed if speed is None else speed)
        refusal = Spin.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(Spin(task, angle, rate, self._motion_tools), while_lost)

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Drive straight back by a distance.

        Raises:
            ParameterError: a distance or speed that is not above 0, or a robot that cannot reverse.
        """
        _positive("distance", distance)
        _positive("reverse_speed", self._robot.limits.reverse_speed)
        task = self._activities.task(f"back up {distance:.2f} m")
        rate = _positive("speed", self._parameters.back_up_speed if speed is None else speed)
        return self._recover(BackUp(task, distance, rate, self._motion_tools), while_lost)

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive straight by a distance (negative: backward) and hold the heading by odometry.

        Args:
            distance: metres.
            speed: m/s, within the limits of the drive.
            direction: radians in the base frame, omnidirectional robots only; others fail at once.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a speed that is not above 0.
        """
        rate = _positive("speed", self._parameters.straight_speed if speed is None else speed)
        line = StraightLine(distance, direction, rate)
        task = self._activities.task(f"drive {distance:.2f} m on its heading")
        refusal = line.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(DriveOnHeading(task, line, self._motion_tools), while_lost)

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive out of a tight spot by range sensors and odometry alone.

        Sensors do not see keep-out zones. A robot that knows where it is stays out of them, and
        drives out of one in which it stands on the map.

        Args:
            clearance: desired metres around the outline; None: room to turn, at least 15 cm.
            distance: maximum metres to drive.
            speed: m/s.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a value that is not above 0.
        """
        room = self._tools.motions.room_to_turn
        escape_goal = EscapeGoal(
            _positive("clearance", room if clearance is None else clearance),
            _positive("distance", distance),
            _positive("speed", self._parameters.escape_speed if speed is None else speed),
        )
        task = self._activities.task("escape to free space")
        way_out, located = self._tools.global_costmap.way_out, None if self._lost else self._state
        if way_out is not None and located is not None:
            return self._recover(GoalDrive(task, self._tools, [way_out], None), while_lost)
        motions, parameters = self._tools.motions, self._parameters
        return self._recover(motions.escape(task, escape_goal, located, parameters), while_lost)

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive a velocity for some seconds; a call during this time renews it.

        Raises:
            NavigationError: LOST, if the robot is, and is not to be driven then or stopped.
        """
        monitor, state, current = self._monitor, self._state, self._activities.current
        moves = twist != STANDSTILL and not while_lost and self._parameters.lost_motions == "refuse"
        if moves and state is not None and monitor.refuses(self._parameters):
            raise NavigationError(FailureCode.LOST, monitor.refusal(state.estimate))
        now = 0.0 if state is None else state.time
        if isinstance(current, DriveFor):
            current.renew(twist, now, seconds, contact)
        else:
            current = DriveFor(self._activities.task("drive on command"), twist, now, seconds)
            current.contact = contact
            self._activities.start(current, "goal", "driving on command")
        current.while_lost = while_lost or twist == STANDSTILL
        current.gives_way = gives_way
        return current.task

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> MotionTask:
        """Let the operator drive, through `teleoperation`.

        Args:
            seconds: maximum duration.
            silence: seconds without a velocity command after which the task fails.
        """
        task = self._activities.task("assisted teleoperation")
        timeout = self._parameters.teleop_timeout
        return self._recover(Teleoperation(task, seconds, silence, timeout), while_lost=True)

    @property
    def teleoperation(self) -> Teleoperation | None:
        """The running teleoperation task, None without one; accepts the operator's velocities."""
        current = self._activities.current
        return current if isinstance(current, Teleoperation) else None

    def _recover(self, executor: MotionExecutor, while_lost: bool) -> MotionTask:
        executor.while_lost = while_lost
        self._tools.count("recoveries")
        self._activities.start(executor, "recovery", executor.task.what)
        return executor.task


def _positive(name: str, value: float) -> float:
    if not value > 0.0:
        raise ParameterError(name, f"{value:g} must be above 0")
    return value
