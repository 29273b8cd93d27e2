"""How long controllers take for a command: `run()` gives one row per controller and place."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from stack.components import ControlState, component
from stack.control.path_follower import PathFollower
from stack.types import Pose2D
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, robot, room

CONTROLLERS = ("pure_pursuit", "graceful", "dwb", "mppi")
COMMANDS = 120

NARROW = 1.3 * 0.4
"""Metres between two walls that the toy robot, 0.4 m wide, drives between."""


def in_the_open() -> ToyWorld:
    """A room of 5 m × 5 m, about a local costmap."""
    return ToyWorld(room(5, 5), robot(), Pose2D(0.6, 2.5))


def between_walls() -> ToyWorld:
    """A corridor 1.3 times as wide as the robot: every rollout is near an obstacle."""
    walls = [(0, 0, 5, 0), (0, NARROW, 5, NARROW), (0, 0, 0, 5), (5, 0, 5, 5)]
    return ToyWorld(walls, robot(), Pose2D(0.6, NARROW / 2))


PLACES: dict[str, Callable[[], ToyWorld]] = {"room": in_the_open, "corridor": between_walls}


def run() -> list[dict[str, Any]]:
    """Rows with the median and the 95th percentile of the milliseconds for a command."""
    return [row(name, place) for place in PLACES for name in CONTROLLERS]


def row(name: str, place: str) -> dict[str, Any]:
    """Commands of one controller at its defaults, on a straight path 3.9 m long."""
    world, cls = PLACES[place](), component("controller", name)
    follower, costs = (
        PathFollower(cls, cls.Parameters(), world.robot, world.period),
        ToyCostmap(world),
    )
    path = polyline((0.6, world.pose.y), (4.5, world.pose.y))
    progress = follower.progress_on(path)
    follower.follow(progress)
    times = []
    for _ in range(COMMANDS):
        state = ControlState(world.time, world.pose, world.twist, costs.grid)
        began = perf_counter()
        progress.advance(world.pose)
        twist = follower.step(state)
        times.append(1e3 * (perf_counter() - began))
        world.drive(twist)
        if world.pose.distance_to(path.goal) < 0.3:
            break
    times = times[2:]  # the first ones load the kernels
    return {
        "controller": name, "place": place, "commands": len(times),
        "median ms": round(float(np.median(times)), 3),
        "95 % ms": round(float(np.percentile(times, 95)), 3),
    }  # fmt: skip
