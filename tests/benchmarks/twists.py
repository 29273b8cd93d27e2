"""Random velocities through the safety stage, in furnished rooms with people: counts contacts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import atan2, cos, hypot, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from missions.bench.bench import PASSED, Bench, Key, Options, Row
from missions.bench.run_table import measured
from missions.execution.resources import MISSIONS, load_robot
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.frames.deskew import Deskewer
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.parameters import EkfParameters
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.smoothing import smooth_observation
from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.tracker import Tracker
from stack.safety.monitor import moving_discs
from stack.safety.parameters import SafetyParameters
from stack.streams import stream
from stack.types import (
    FloatArray,
    Observation,
    ObstaclePoints,
    Pose2D,
    Scan,
    TrackedObject,
    Twist,
)
from tests.benchmarks.benchmark import tell
from tests.benchmarks.clutter import Room
from tests.benchmarks.table import Rows
from tests.stack.safety.obstacles import SafetyStage

ROBOT_NAMES = ("scout", "jackal", "glide", "buggy")
BY_SONAR = "scout, sonars only"
PERIOD = 0.05
TWISTS_PER_WORLD = 100
SHORTEST, LONGEST = 0.2, 2.0
"""Seconds that a velocity is wanted; their logarithm is uniform, mean 0.78 s."""

MOVING = 0.02
"""Speed, m/s and rad/s, above which the robot moves."""

SEEN = 0.15
"""Metres between a contact and an obstacle point that shows it."""


@dataclass(frozen=True)
class Touch:
    """A contact.

    Attributes:
        time: seconds.
        obstacle: what was touched.
        x: of the contact, base frame, metres.
        y: likewise.
        cause: `standing` robot, `person` who came faster than the robot, or else `robot`.
        speed: of the robot at the contact towards the obstacle, m/s.
        their_speed: of the obstacle towards the robot, m/s.
        seen: whether an obstacle point was near the contact in the step before.
        blind: whether no sensor covers that direction.
        reason: why safety limited the velocity.
    """

    time: float
    obstacle: str
    x: float
    y: float
    cause: str
    speed: float
    their_speed: float
    seen: bool
    blind: bool
    reason: str


@dataclass(frozen=True)
class Drive:
    """Entry: a robot in a world for a number of velocities."""

    robot: str
    world: int
    twists: int

    @property
    def key(self) -> Key:
        """Unique key in the table."""
        return self.robot, self.world

    @property
    def label(self) -> str:
        """The robot."""
        return self.robot


@dataclass(frozen=True)
class Driven(Row):
    """Row: what became of a drive.

    Attributes:
        driven: metres.
        moving: share of the steps in which the robot moved.
        clearance: smallest, metres.
        touch: the contact that ended the drive; a person pushes the robot, so what follows says
            nothing about safety.
    """

    robot: str
    world: int
    status: str
    cause: str
    twists: int = 0
    seconds: float = 0.0
    driven: float = 0.0
    moving: float = 0.0
    clearance: float = 0.0
    wall_seconds: float = 0.0
    touch: dict[str, Any] | None = None

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        figures = f"{self.driven:.1f} m in {self.seconds:.0f} s"
        return figures if self.touch is None else f"{figures}; {self.touch}"


def entries_of(options: Options) -> list[Drive]:
    """Return a drive of each robot in each world, and in a tenth of them by sonar alone."""
    entries = [
        Drive(name, world, TWISTS_PER_WORLD) for world in options.seeds for name in ROBOT_NAMES
    ]
    fewer = range(max(1, len(options.seeds) // 10))
    return [*entries, *(Drive(BY_SONAR, world, TWISTS_PER_WORLD) for world in fewer)]


def settings_of(entry: Drive) -> dict[str, Any]:
    """Return what the drives depend on."""
    return {"twists in a world": entry.twists, "safety": str(SafetyParameters())}


def table_of(runs: Sequence[Driven]) -> Rows:
    """Return a row for each robot."""
    return [_row(name, [run for run in runs if run.robot == name]) for name in described()]


def twist_table(twists: int, options: Options) -> Rows:
    """A row for each robot; `twists` in all over the four robots, and a tenth by sonar alone."""
    worlds = max(1, round(twists / len(ROBOT_NAMES) / TWISTS_PER_WORLD))
    return table_of(measured(BENCH, replace(options, seeds=range(worlds)), tell))


def described() -> dict[str, RobotDescription]:
    """The robots by name."""
    found = {name: load_robot(name, MISSIONS) for name in ROBOT_NAMES}
    return {**found, BY_SONAR: replace(found["scout"], lidar=None)}


def drive(entry: Drive, picture: Path) -> Driven:
    """Drive random velocities in a random room; the same in every process."""
    robot = described()[entry.robot]
    random = stream(entry.world, "twists")
    room = Room(stream(entry.world, "clutter"), robot.footprint.circumscribed_radius)
    world, heading = room.world(people=entry.world % 3), float(random.uniform(-pi, pi))
    body = SimulatedBody(
        replace(robot, camera=None), world, start=Pose2D(0.0, 0.0, heading), seed=entry.world
    )
    try:
        loop, twists = SafetyLoop(body, robot), 0
        for twist, seconds in wishes(robot, random, entry.twists):
            twists += 1
            for _ in range(round(seconds / PERIOD)):
                loop.step(twist)
                if loop.touch is not None:
                    break
            if loop.touch is not None:
                break
        return Driven(
            entry.robot,
            entry.world,
            PASSED,
            "",
            twists,
            body.time,
            loop.driven,
            loop.moving / loop.steps,
            body.clearance,
            touch=loop.touch and asdict(loop.touch),
        )
    finally:
        body.close()


def wishes(robot: RobotDescription, random: Generator, count: int) -> Iterator[tuple[Twist, float]]:
    """Yield velocities over the full range of a drive, and the seconds that each is wanted."""
    limits = robot.limits
    ranges = (
        (-limits.reverse_speed, limits.linear_speed),
        (-limits.angular_speed, limits.angular_speed),
        (-limits.lateral_speed, limits.lateral_speed),
    )
    for _ in range(count):
        speeds = [
            float(
                random.choice([0.0, low, high, random.uniform(low, high)], p=[0.2, 0.1, 0.1, 0.6])
            )
            for low, high in ranges
        ]
        yield Twist(*speeds), float(np.exp(random.uniform(np.log(SHORTEST), np.log(LONGEST))))


class SafetyLoop:
    """The stages of the step loop from the body to safety and back.

    Attributes:
        touch: the contact, if there was one.
        driven: metres. steps: so far. moving: steps in which the robot moved.
    """

    def __init__(
        self, body: SimulatedBody, robot: RobotDescription,
        parameters: SafetyParameters | None = None,
    ) -> None:  # fmt: skip
        self._body, self._frames, self._deskewer = body, TransformBuffer(), Deskewer()
        self._odometry = EkfOdometry(EkfParameters(), robot)
        self._memory = ObstacleMemory(robot)
        self._safety = SafetyStage(robot, parameters or SafetyParameters(), PERIOD)
        self._tracker = Tracker(TrackerParameters())
        self._tracks: tuple[TrackedObject, ...] = ()
        self.touch: Touch | None = None
        self.driven, self.steps, self.moving = 0.0, 0, 0

    def step(self, wanted: Twist) -> None:
        """One control period with a wanted velocity."""
        body = self._body
        observation = body.sense()
        motion = self._odometry.update(observation)
        self._frames.add(motion)
        observation = smooth_observation(self._deskewer.update(observation, self._frames))
        obstacles = self._memory.update(observation, self._frames)
        moving = moving_discs(self._tracked(observation), motion.pose)
        command = self._safety.limit(wanted, motion, obstacles, moving=moving)
        body.command(BodyCommand(command))
        before, people = body.truth, body.people
        body.wait(PERIOD)
        self.driven += before.pose.distance_to(body.truth.pose)
        self.moving += _moves(before.twist)
        self.steps += 1
        contacts = [event.fields for event in body.take_events() if event.kind == "contact"]
        if contacts:
            self.touch = self._touch(contacts[0], before.twist, people, obstacles)

    def _tracked(self, observation: Observation) -> list[TrackedObject]:
        """Moving objects now, odom frame; nothing is known of the walls."""
        scan = observation.named("lidar", Scan)
        if scan is not None:
            pose = self._frames.pose_at("odom", scan.stamp)
            self._tracks = self._tracker.update(pose, scan, observation.time)
        return [track.at(observation.time) for track in self._tracks]

    def _touch(
        self,
        contact: Mapping[str, Any],
        twist: Twist,
        people: FloatArray,
        obstacles: ObstaclePoints,
    ) -> Touch:
        """Describe a contact; `twist` and `people` are those of the step before."""
        body, touched = self._body, contact["touched"]
        at = Pose2D(*contact["at"]).relative_to(body.truth.pose)
        out, their_velocity = np.array([at.x, at.y]), np.zeros(2)
        if contact["is_person"]:
            number = int(np.argmin(np.hypot(*(body.people[:, :2] - contact["at"]).T)))
            there = Pose2D(*body.people[number, :2]).relative_to(body.truth.pose)
            out = np.array([there.x - at.x, there.y - at.y])
            c, s = cos(body.truth.pose.heading), sin(body.truth.pose.heading)
            step = (body.people - people)[number, :2] / PERIOD
            their_velocity = step @ np.array([[c, -s], [s, c]])
        out /= max(hypot(*out), 1e-9)
        velocity = twist.linear - twist.angular * at.y, twist.lateral + twist.angular * at.x
        speed, their_speed = float(out @ velocity), -float(out @ their_velocity)
        cause = "person" if their_speed > max(speed, 0.0) else "robot"
        near = np.hypot(*(obstacles.points - (at.x, at.y)).T)
        return Touch(
            round(body.time, 2), touched, round(at.x, 3), round(at.y, 3),
            "standing" if body.tally.against_standing else cause,
            round(speed, 3), round(their_speed, 3), bool(near.size and near.min() < SEEN),
            obstacles.is_blind(atan2(at.y, at.x)), self._safety.reason,
        )  # fmt: skip


def _moves(twist: Twist) -> bool:
    return max(abs(twist.linear), abs(twist.angular), abs(twist.lateral)) > MOVING


def _row(name: str, runs: Sequence[Driven]) -> dict[str, Any]:
    """Return totals over the worlds of a robot."""
    touches = [run.touch for run in runs if run.touch is not None]
    count = Counter(class_of(touch) for touch in touches)
    return {
        "robot": name, "worlds": len(runs), "twists": sum(run.twists for run in runs),
        "hours": sum(run.seconds for run in runs) / 3600.0,
        "km": sum(run.driven for run in runs) / 1000.0,
        "moving %": 100.0 * float(np.mean([run.moving for run in runs])),
        "drove into": count["robot"],
        "drove into unseen": count["unseen"],
        "struck moving": count["person"],
        "struck standing": count["standing"],
        "failed": "; ".join(
            f"world {run.world}: {_text(run.touch)}"
            for run in runs if run.touch is not None and run.touch["cause"] == "robot"
        ),
    }  # fmt: skip


def class_of(touch: Mapping[str, Any]) -> str:
    """Return the cause; `unseen` if the robot drove slowly into what no sensor saw or covers."""
    hidden = touch["cause"] == "robot" and touch["blind"] and not touch["seen"]
    slow = touch["speed"] <= SafetyParameters().blind_speed + MOVING
    return "unseen" if hidden and slow else str(touch["cause"])


def _text(touch: Mapping[str, Any]) -> str:
    if touch["blind"]:
        sight = "seen before, no sensor there" if touch["seen"] else "no sensor there"
    else:
        sight = "seen" if touch["seen"] else "not seen"
    where = f"({touch['x']:.2f}, {touch['y']:.2f})"
    return f"{touch['obstacle']} at {where}, {sight}, {touch['speed']:.2f} m/s"


BENCH = Bench(Driven, entries_of, drive, settings_of, table_of)
