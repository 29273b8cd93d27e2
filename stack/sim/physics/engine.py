"""Interface of a physics engine: one loaded world with its robots, and pictures of it.

The simulation knows nothing else of the engine. Lidars and sonars cast their rays at the outlines
of the world file, so an engine needs no rays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import acos, atan2, hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stack.body import BlockPose, GroundTruth
from stack.drivetrain.description import LidarDescription, RobotDescription
from stack.errors import InputError
from stack.sim.physics.mirrors import MirrorFace
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import World
from stack.types import CameraModel, FloatArray, Pose2D, Twist

Vector = tuple[float, float, float]

GRAVITY = 9.81
"""Gravitational acceleration, m/s2."""


class BaseState(NamedTuple):
    """State of the base frame in space. Plain floats instead of arrays: it is asked for often.

    Attributes:
        position: metres, world frame.
        orientation: quaternion x, y, z, w, world from base.
        rotation: the nine numbers of the same rotation's matrix, row by row.
        velocity: m/s of the frame's origin, world frame.
        spin: angular velocity, rad/s, world frame.
    """

    position: Vector
    orientation: tuple[float, float, float, float]
    rotation: tuple[float, ...]
    velocity: Vector
    spin: Vector


class Touch(NamedTuple):
    """A place at which the robot touches something.

    Attributes:
        name: of what it touches.
        place: x, y in the world frame, metres.
        depth: by which the bodies overlap, metres.
        is_person: whether it is a person of the world.
        by: link of the arm that touches it; empty for the base.
    """

    name: str
    place: tuple[float, float]
    depth: float = 0.0
    is_person: bool = False
    by: str = ""


class JointReading(NamedTuple):
    """State of the joints of an arm: positions, velocities and efforts, each (n,)."""

    positions: FloatArray
    velocities: FloatArray
    efforts: FloatArray


class FingerState(NamedTuple):
    """State of a gripper: width, metres, speed of the faster finger, m/s, force, N."""

    width: float
    speed: float
    force: float


class PhysicsArm(ABC):
    """An arm of a robot in a physics engine; it is at its posture `home` at the start."""

    @abstractmethod
    def place(self, positions: Sequence[float]) -> None:
        """Put the joints at positions, at rest."""

    @abstractmethod
    def drive(self, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Set what the joint motors strive for from now on, within their efforts."""

    @abstractmethod
    def joints(self) -> JointReading:
        """Return the state of the joints."""

    @abstractmethod
    def move_fingers(self, width: float, force: float) -> None:
        """Move the fingers to a width, metres, pressing with at most a force, N."""

    @abstractmethod
    def finger_state(self) -> FingerState:
        """Return the state of the fingers; only for an arm with a gripper."""


class PhysicsRobot(ABC):
    """A robot in a physics engine.

    Attributes:
        wheel_places: (n, 2) contact points of the wheels, driven ones first, base frame, metres.
        arm: None without one.
    """

    wheel_places: FloatArray
    arm: PhysicsArm | None = None

    @abstractmethod
    def base_state(self) -> BaseState:
        """Return the state of the base frame in space."""

    @abstractmethod
    def place(self, pose: Pose2D) -> None:
        """Place the robot at a pose, at rest, with wheels at rest."""

    @abstractmethod
    def set_wheel_speeds(self, *speeds: float) -> None:
        """Set the target speeds of the driven wheels, rad/s. All zero: park the wheels."""

    @abstractmethod
    def set_wheel_torques(self, *torques: float) -> None:
        """Drive the wheels with torques, N m, in the next step alone."""

    @abstractmethod
    def wheel_speeds(self) -> list[float]:
        """Return the speeds of the driven wheels, rad/s."""

    @abstractmethod
    def steer(self, angles: Sequence[float]) -> None:
        """Set the target angles of the steered wheels, left and right, radians."""

    @abstractmethod
    def wheel_angles(self) -> list[float]:
        """Return the angle that each driven wheel has rolled since the start, radians."""

    @abstractmethod
    def steering_angles(self) -> list[float]:
        """Return the angles of the steered wheels, left and right, radians."""

    @abstractmethod
    def set_wheel_friction(self, wheel: int, friction: float) -> None:
        """Set the friction of a wheel, counted as in `wheel_places`."""

    @abstractmethod
    def slide(self) -> None:
        """Take the friction from the tyres: the wheels no longer hold or move the body."""

    @abstractmethod
    def grip(self) -> None:
        """Give the tyres their friction back after `slide`."""

    @abstractmethod
    def set_velocity(self, x: float, y: float, spin: float) -> None:
        """Set the velocity of the base frame: m/s in the world frame, rad/s."""

    @abstractmethod
    def touching(self) -> list[Touch]:
        """Return the contacts except those with the floor."""

    @abstractmethod
    def distance(self, reach: float) -> float:
        """Return the distance from the robot to the nearest obstacle, metres, at most `reach`."""

    _truth: tuple[BaseState, GroundTruth] | None = None

    def truth(self) -> GroundTruth:
        """Return pose and velocity of the base frame in the plane; computed once for a state."""
        state = self.base_state()
        if self._truth is None or self._truth[0] is not state:
            (x, y, _), _, r, (vx, vy, _), (_, _, spin) = state
            forward = hypot(r[0], r[3])
            c, s = r[0] / forward, r[3] / forward
            twist = Twist(c * vx + s * vy, spin, c * vy - s * vx)
            self._truth = state, GroundTruth(Pose2D(x, y, atan2(s, c)), twist)
        return self._truth[1]

    @property
    def tilt(self) -> float:
        """Angle between the base's z axis and the vertical, radians."""
        return acos(max(-1.0, min(1.0, self.base_state().rotation[8])))


class Renderer(ABC):
    """Draws pinhole pictures of a world, in the process of a camera."""

    @property
    @abstractmethod
    def driver(self) -> str:
        """Driver of the graphics library, if pictures depend on it; otherwise empty."""

    @abstractmethod
    def draw(
        self, request: RenderRequest, view: FloatArray
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours (height, width, 3) and depths (height, width), 0 near and 1 far.

        Args:
            request: where everything is.
            view: (4, 4) OpenGL eye frame from world.
        """

    @abstractmethod
    def close(self) -> None:
        """Release what it holds. Safe to call twice."""


class PhysicsEngine(ABC):
    """A world in a physics engine. Doors and people are moved; robots move by their wheels.

    Args:
        world: the world to load.
    """

    @abstractmethod
    def __init__(self, world: World) -> None: ...

    @abstractmethod
    def add_robot(self, description: RobotDescription, start: Pose2D) -> PhysicsRobot:
        """Add a robot; it is an obstacle of the others.

        Args:
            description: the robot; the root frame of its model is the base frame, on the floor.
            start: pose of the base frame, world frame.

        Raises:
            BodyError: the engine cannot simulate this robot.
        """

    @abstractmethod
    def reset(self) -> None:
        """Put everything back to how it was loaded; what follows is as in a new engine, exactly.

        Robots are at their starts again, doors as in the world file, people nowhere.
        """

    @abstractmethod
    def step(self, count: int = 1) -> None:
        """Advance by `count` physics periods."""

    @abstractmethod
    def place_door(self, name: str, closed: bool) -> None:
        """Move a door into its gap, or out of reach."""

    def blocks(self) -> list[BlockPose]:
        """Return where the blocks of the world are, in its order; none in this engine."""
        return []

    def drop_box(self, pose: Pose2D, size: tuple[float, float, float]) -> None:
        """Put an immovable box of a size (length, width, height), metres, onto the floor.

        Raises:
            InputError: this engine cannot.
        """
        raise InputError("this physics engine cannot add a box while it runs")

    @abstractmethod
    def place_people(self, positions: Sequence[tuple[float, float]]) -> None:
        """Move the people to positions in metres, in the order of the world; nan: nowhere."""

    @abstractmethod
    def close(self) -> None:
        """Release what it holds. Safe to call twice."""

    @classmethod
    @abstractmethod
    def own_ranges(cls, model: str, lidar: LidarDescription) -> FloatArray:
        """Return (beams,) the distance along each beam to the robot itself, metres; +inf: none.

        Shapes that the sensor is in are left out: its housing. Joints are at 0.

        Args:
            model: text of the robot's URDF; its root frame is the base frame, on the floor.
            lidar: with its mount, height and beams.

        Raises:
            BodyError: the URDF cannot be read.
        """

    @classmethod
    @abstractmethod
    def renderer(
        cls, setup: RenderSetup, model: CameraModel, mirror: MirrorFace | None = None
    ) -> Renderer:
        """Return what draws the pictures of a camera.

        Args:
            setup: world, robot and camera.
            model: the pinhole camera that is drawn.
            mirror: if given, only what this face reflects is in the scene.

        Raises:
            BodyError: the engine cannot draw this world or robot.
        """
