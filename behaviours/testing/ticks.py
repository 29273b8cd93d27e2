"""Ticks, pauses and halts one behaviour, as a mission's tree does."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour
from behaviours.testing.scripted_robot import ScriptedRobot

TICK_PERIOD = 0.1
"""Seconds between two ticks of the tree."""


def tick(behaviour: Behaviour, robot: ScriptedRobot, seconds: float = 0.0) -> Status:
    """Tick once now, then every 0.1 s of the robot's clock, until it ends or `seconds` are over.

    Sets the behaviour up with the robot if necessary. Returns the status after the last tick.
    """
    if vars(behaviour).get("robot") is not robot.interface:
        behaviour.setup(robot=robot.interface)
    behaviour.tick_once()
    for _ in range(round(seconds / TICK_PERIOD)):
        if behaviour.status is not Status.RUNNING:
            break
        robot.advance(TICK_PERIOD)
        behaviour.tick_once()
    return behaviour.status


def pause(behaviour: RobotBehaviour, robot: ScriptedRobot, seconds: float) -> None:
    """Pause and resume the behaviour, as a tree does when the operator pauses the mission."""
    behaviour.pause(robot.time)
    robot.advance(seconds)
    behaviour.resume(robot.time)


def halt(behaviour: Behaviour) -> None:
    """Halt the behaviour as a tree does when another node pre-empts it."""
    behaviour.stop(Status.INVALID)
