"""Interface of the robot for behaviours, by capability.

No call blocks. A call that takes time returns a task, which keeps its own outcome; a new motion
task cancels the previous one. Names follow nav2_simple_commander.
"""

from stack.robot.arm import Arm, GraspTask, Gripper, PlaceTask
from stack.robot.base import Base
from stack.robot.localisation import Localisation
from stack.robot.map import Map
from stack.robot.perception import Perception
from stack.robot.robot import JsonValue, Robot
from stack.robot.task import Task

__all__ = [
    "Arm",
    "Base",
    "GraspTask",
    "Gripper",
    "JsonValue",
    "Localisation",
    "Map",
    "Perception",
    "PlaceTask",
    "Robot",
    "Task",
]
