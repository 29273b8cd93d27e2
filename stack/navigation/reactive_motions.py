"""Motions by range sensors and odometry alone, for recoveries and as parts of drives."""

from __future__ import annotations

from stack.costmap.costmap import Costmap
from stack.drivetrain.description import RobotDescription
from stack.navigation.escape.escape import Escape, EscapeGoal
from stack.navigation.escape.search import NO_FENCE
from stack.navigation.escape.surroundings import Surroundings
from stack.navigation.escape.unseen import zone_edges
from stack.navigation.parameters import NavigationParameters
from stack.navigation.recoveries import BackUpMotion, RecoveryTools
from stack.navigation.tasks import MotionTask
from stack.safety.monitor import CollisionMonitor
from stack.types import Perceived

MAKES_ROOM = 1.5
"""Metres that a drive may move away from an obstacle to turn onto its path."""


class ReactiveMotions:
    """Makes motions that need no path and no map, but for the keep-out zones on it.

    Args:
        robot: outline and limits.
        costmap: with the keep-out zones.
        period: seconds between control steps.

    Attributes:
        tools: what recoveries are made with.
        surroundings: what the sensors have seen lately; `look` in each step.
    """

    def __init__(self, robot: RobotDescription, costmap: Costmap, period: float) -> None:
        self._robot, self._costmap = robot, costmap
        self.tools = RecoveryTools(robot, CollisionMonitor(robot), period)
        self.surroundings = Surroundings()

    @property
    def room_to_turn(self) -> float:
        """Clearance around the outline with room to turn, at least 15 cm, metres."""
        outline = self._robot.footprint
        return max(0.15, outline.circumscribed_radius - outline.inscribed_radius + 0.05)

    def back_up(self, distance: float, parameters: NavigationParameters) -> BackUpMotion | None:
        """Return a motion straight back by metres; None if the robot cannot reverse."""
        if not self._robot.limits.reverse_speed:
            return None
        task = MotionTask(f"back up {distance:.2f} m", lambda _: None)
        return BackUpMotion(task, distance, parameters.back_up_speed, self.tools)

    def make_room(self, perceived: Perceived, parameters: NavigationParameters) -> Escape:
        """Return a motion to where the robot can turn."""
        task = MotionTask("make room to turn", lambda _: None)
        speeds = parameters.escape_speed, parameters.spin_speed
        return self.escape(task, EscapeGoal(self.room_to_turn, MAKES_ROOM, *speeds), perceived)

    def escape(self, task: MotionTask, goal: EscapeGoal, located: Perceived | None) -> Escape:
        """Return an escape that keeps out of keep-out zones, unless the robot stands in one.

        Args:
            task: handle of the motion.
            goal: what counts as free space.
            located: with the pose; None: the robot does not know where it is.
        """
        fence, costmap = NO_FENCE, self._costmap
        if located is not None and costmap.way_out is None:
            reach = goal.distance + 2.0 * self._robot.footprint.circumscribed_radius
            pose, zones = located.estimate.pose, costmap.forbidden.values()
            fence = located.motion.pose.transform(zone_edges(zones, costmap.view, pose, reach))
        return Escape(task, goal, self.surroundings, self.tools, fence)
