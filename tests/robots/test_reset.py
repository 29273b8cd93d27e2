"""`Simulation.reset`: what follows is bit for bit what a new simulation gives."""

import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from hashlib import sha256
from math import pi, sin
from pathlib import Path

import numpy as np
import pytest

import missions
from robots.load import find_robot, read_robot
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.drivetrain.description import DepthCameraDescription
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import Box, Door, FrictionZone, Person, Push, Trigger, WorldEvent
from stack.types import CameraModel, Pose2D, Twist
from tests.stack.sim.sim_rover import CAMERA, EQUIPPED, ROVER, square_room

ORIGIN, ASIDE = Pose2D(0.0, 0.0), Pose2D(0.0, 1.5, pi / 2)
BLIND = replace(EQUIPPED, camera=None)
SEEING = replace(
    BLIND,
    camera=replace(CAMERA, noise=2.0),
    depth_cameras={"depth": DepthCameraDescription(CameraModel(64, 48, 60.0, (0.1, 0.0, 0.2)))},
)
WALKS = np.array([[1.2, -2.0], [1.2, 2.0]])

PLAIN = square_room(3.0, boxes=(Box(Pose2D(1.0, 0.2, 0.3), (0.3, 0.3, 0.5)),))
"""The robot drives into a box: the contacts of the last run must leave no trace."""

PEOPLE = replace(
    PLAIN,
    people=(
        Person("loop", WALKS), Person("social", -WALKS, model="social_force"),
        Person("other", WALKS + 0.5, model="social_force"),
    ),
)  # fmt: skip
EVENTFUL = replace(
    PLAIN,
    doors=(Door("gate", (-1.0, -1.0), (-1.0, 1.0)),),
    friction_zones=(FrictionZone((-3.0, -3.0, 0.2, 3.0), 0.2),),
    timeline=(
        WorldEvent(Trigger(0.3), open_door="gate"),
        WorldEvent(Trigger(0.5), push=Push(Pose2D(0.3, 0.1, 0.2))),
        WorldEvent(Trigger(1.2), battery=0.3),
        WorldEvent(Trigger(1.4), move_robot=Pose2D(-0.5, 0.3, 2.0)),
        WorldEvent(Trigger(near=(-0.5, 0.3, 0.4), after=0.3), close_door="gate"),
    ),
)


def shipped(name):
    return replace(read_robot(find_robot(name, Path())), camera=None)


def bits(value):
    """The bytes of a record: those of its arrays, the others' exact texts."""
    if is_dataclass(value):
        return b"".join(bits(getattr(value, field.name)) for field in fields(value))
    return value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode()


def drive(bodies, seconds, faster=1.0):
    """Drive all robots for a while; the hash of all that they sense and of the truth."""
    digest, period = sha256(), 0.05
    for step in range(round(seconds / period)):
        for number, body in enumerate(bodies):
            observation = body.sense()
            for name, measurement in sorted(observation.measurements.items()):
                digest.update(name.encode() + bits(measurement))
            digest.update(bits(body.truth) + bits(body.tally) + repr(body.take_events()).encode())
            digest.update(bits(body.people) + repr((body.time, body.clearance)).encode())
            turn = faster * sin(0.3 * step + number)
            body.command(BodyCommand(Twist(0.5 * faster, turn), capture=True, depth=True))
            body.wait(period)
    return digest.hexdigest()


def bodies_of(world, robots, seed, simulations):
    simulation = Simulation(world)
    simulations.append(simulation)
    return simulation, [
        SimulatedBody(robot, world, start=start, seed=seed + number, simulation=simulation)
        for number, (robot, start) in enumerate(zip(robots, (ORIGIN, ASIDE), strict=False))
    ]


@pytest.mark.parametrize(
    ("world", "robots"),
    [
        (PLAIN, [BLIND]),
        (PEOPLE, [BLIND]),
        (EVENTFUL, [BLIND]),
        pytest.param(PEOPLE, [SEEING], marks=pytest.mark.slow),
        (EVENTFUL, [shipped("glide")]),
        (PLAIN, [shipped("buggy")]),
        (EVENTFUL, [shipped("jackal")]),
        (PEOPLE, [BLIND, ROVER]),
    ],
    ids=["box", "people", "events", "cameras", "rollers", "car", "skids", "two robots"],
)
def test_what_follows_a_reset_is_what_a_new_simulation_gives(world, robots):
    simulations = []
    try:
        simulation, bodies = bodies_of(world, robots, 1, simulations)
        first = drive(bodies, 3.0, faster=1.3)
        assert world is not PLAIN or bodies[0].tally.by_robot > 0
        bodies[0].close()  # as at the end of a run
        simulation.reset(5)
        assert [body.time for body in bodies] == [0.0] * len(bodies)
        again = drive(bodies, 2.0)
        _, fresh = bodies_of(world, robots, 5, simulations)
        assert again == drive(fresh, 2.0)
        simulation.reset(1)
        assert drive(bodies, 3.0, faster=1.3) == first
    finally:
        for simulation in simulations:
            simulation.close()


@pytest.mark.slow
def test_a_mission_after_a_reset_has_the_log_of_one_in_a_new_process():
    bodies, made = [], []

    def make(setup):
        if not bodies:
            made.append(Simulation(setup.world))
            body = SimulatedBody(
                setup.robot, setup.world, start=setup.start, seed=setup.seed, simulation=made[0]
            )
            bodies.append(body)
        return bodies[0]

    try:
        missions.run("01_drive_to_a_point", seed=1, body=make, arguments={"goal": "[2, 2, 0]"})
        made[0].reset(2)
        report = missions.run("01_drive_to_a_point", seed=2, body=make)
    finally:
        made[0].close()
    code = "import missions; print(missions.run('01_drive_to_a_point', seed=2).log_sha256)"
    alone = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert report.log_sha256 == alone.stdout.split()[-1]
