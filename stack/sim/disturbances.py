"""Applies disturbances to a simulated robot and its world, between two steps."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.errors import InputError
from stack.parameters import suggestion
from stack.sim.faults.fault import outside
from stack.sim.scene_state import RobotShape
from stack.sim.simulated_robot import SimulatedRobot
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import Door, Push
from stack.types import (
    Disturbance,
    DroppedBox,
    FloatArray,
    Footprint,
    LiftedRobot,
    MovedDoor,
    Pose2D,
    PushedRobot,
    SetCharge,
    SilencedSensor,
)

AHEAD = 1.0
"""Metres between the outline of the robot and a box that is dropped before it."""

PUSH_TIME = 0.8
"""Seconds of a shove."""

MOST_BOXES = 50


def disturb(simulation: Simulation, robot: SimulatedRobot, disturbance: Disturbance) -> None:
    """Apply a disturbance; the robot reports it as an event.

    Raises:
        InputError: there is no such door or sensor, or no room for it.
    """
    match disturbance:
        case DroppedBox(pose, size):
            _drop(simulation, robot, pose, size)
        case MovedDoor(name, closed):
            _move_door(simulation, robot, name, closed)
        case PushedRobot(by):
            robot.push(Push(by, over=PUSH_TIME))
        case LiftedRobot(pose):
            _lift(simulation, robot, pose)
        case SilencedSensor(name, works):
            robot.silence(name, not works)
        case SetCharge(charge):
            robot.set_charge(charge)


def _drop(
    simulation: Simulation, robot: SimulatedRobot, pose: Pose2D | None,
    size: tuple[float, float, float],
) -> None:  # fmt: skip
    here = robot.truth.pose
    if pose is None:
        ahead = robot.description.footprint.front + AHEAD + size[0] / 2.0
        x, y = here.transform(np.array([[ahead, 0.0]]))[0]
        pose = Pose2D(float(x), float(y), here.heading)
    _check_room("box", pose, hypot(size[0], size[1]) / 2.0, simulation.movers())
    if len(simulation.boxes) >= MOST_BOXES:
        raise InputError(f"there are {MOST_BOXES} dropped boxes already")
    corners = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    outline = Footprint(corners * size[:2] / 2.0)
    simulation.drop(RobotShape(pose, outline, size[2]), size)


def _move_door(
    simulation: Simulation, robot: SimulatedRobot, name: str, closed: bool | None
) -> None:
    doors = {door.name: door for door in simulation.world.doors}
    if not doors:
        raise InputError("this world has no doors")
    if name and name not in doors:
        hint = suggestion(name, doors)
        raise InputError(f"there is no door {name!r}; {hint}")
    here = robot.truth.pose
    name = name or min(doors, key=lambda other: _distance(doors[other], here))
    simulation.move_door(name, closed=not simulation.doors[name] if closed is None else closed)


def _distance(door: Door, here: Pose2D) -> float:
    x, y = (door.start[0] + door.end[0]) / 2.0, (door.start[1] + door.end[1]) / 2.0
    return hypot(x - here.x, y - here.y)


def _lift(simulation: Simulation, robot: SimulatedRobot, pose: Pose2D) -> None:
    beyond = outside(simulation.world, pose.x, pose.y)
    if beyond:
        raise InputError(beyond)
    _check_room("robot", pose, robot.radius, simulation.movers(but=robot))
    robot.lift(pose)


def _check_room(what: str, pose: Pose2D, radius: float, movers: FloatArray) -> None:
    """Raise InputError if a person or a robot (x, y, radius; metres) is where a thing is put."""
    if np.any(np.hypot(movers[:, 0] - pose.x, movers[:, 1] - pose.y) < radius + movers[:, 2]):
        where = f"({pose.x:.2f}, {pose.y:.2f})"
        raise InputError(f"no room for the {what} at {where}: a person or a robot is there")
