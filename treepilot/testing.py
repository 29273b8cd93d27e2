"""Tools for tests of plugins: scripted robot and body, and what a plugin file defines by name.

robot = ScriptedRobot()
spin = make_behaviour("spin", {"angle": "90 deg"})
assert tick(spin, robot) is Status.RUNNING
robot.task.succeed()
assert tick(spin, robot) is Status.SUCCESS
"""

from behaviours.testing import ScriptedRobot, ScriptedTask, halt, pause, tick
from missions.testing.plugins import choose_component, describe_robot, make_behaviour
from robots.scripted import ScriptedBody, scans_of
from stack.control.path_follower import PathFollower

__all__ = [
    "PathFollower",
    "ScriptedBody",
    "ScriptedRobot",
    "ScriptedTask",
    "choose_component",
    "describe_robot",
    "halt",
    "make_behaviour",
    "pause",
    "scans_of",
    "tick",
]
