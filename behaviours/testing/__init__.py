"""Test kit for behaviours: a scripted robot without a simulator, and a function that ticks.

robot = ScriptedRobot()
drive = NavigateToPose(goal=Pose2D(1, 0))
assert tick(drive, robot) is Status.RUNNING
robot.task.succeed()
assert tick(drive, robot) is Status.SUCCESS
"""

from behaviours.testing.scripted_robot import ScriptedRobot
from behaviours.testing.scripted_task import ScriptedTask
from behaviours.testing.ticks import TICK_PERIOD, halt, pause, tick

__all__ = ["TICK_PERIOD", "ScriptedRobot", "ScriptedTask", "halt", "pause", "tick"]
