"""The PyBullet world with one robot in it: step, wheels, true pose and contacts.

E. Coumans and Y. Bai, PyBullet, 2016-2021. All of PyBullet's conventions stay in here; outside
there are base-frame poses and wheel angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from stack.description import RobotDescription, Wheels
from stack.errors import BodyError
from stack.sim import bullet as loader
from stack.sim.scene import Scene
from stack.sim.settings import SimulationSettings
from stack.sim.world import World
from stack.types import FloatArray, Pose2D, Twist

GRAVITY = 9.81

Vector = tuple[float, float, float]
CASTER_TRAVEL = 0.002
"""Metres that a caster gives way under the robot's whole weight."""

TORQUE_RESERVE = 3.0
"""A wheel motor's strength over what the acceleration limits need on the level."""


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Where the robot's base frame really is, world frame, and how it really moves."""

    pose: Pose2D
    twist: Twist


@dataclass(frozen=True, slots=True)
class BaseState:
    """The base frame in space.

    Attributes:
        position: (3,) metres, world frame.
        rotation: (3, 3) world from base.
        velocity: (3,) m/s of the frame's origin, world frame.
        spin: (3,) rad/s, world frame.
    """

    position: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    spin: FloatArray


class Physics:
    """A PyBullet client with a world's static bodies and a differential-drive robot.

    Args:
        description: the robot; its URDF's root frame is the base frame on the floor.
        world: where it stands.
        start: of the base frame, world frame.
        settings: physics rate and solver iterations.

    Raises:
        BodyError: the URDF cannot be loaded or lacks one of the wheels.
    """

    def __init__(
        self, description: RobotDescription, world: World, start: Pose2D,
        settings: SimulationSettings,
    ) -> None:  # fmt: skip
        self._bullet = bullet = loader.load()
        self.client: int = bullet.connect(bullet.DIRECT)
        try:
            bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
            bullet.setPhysicsEngineParameter(
                fixedTimeStep=1.0 / settings.physics_rate,
                numSolverIterations=settings.solver_iterations,
                physicsClientId=self.client,
            )
            with TemporaryDirectory(prefix="treepilot-") as folder:
                self.scene = Scene.to_touch(bullet, self.client, world, FilePath(folder))
            self.robot = load_robot(bullet, self.client, description.urdf)
            self._prepare_robot(description, world.friction)
            self.place_robot(start)
        except BaseException:
            self.close()
            raise

    def step(self) -> None:
        """One physics period."""
        self._bullet.stepSimulation(physicsClientId=self.client)

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        if self.client >= 0:
            self._bullet.disconnect(physicsClientId=self.client)
            self.client = -1

    def place_robot(self, pose: Pose2D) -> None:
        """Stand the robot at a pose, at rest, its wheels too."""
        turn = (0.0, 0.0, sin(pose.heading / 2.0), cos(pose.heading / 2.0))
        position, orientation = self._bullet.multiplyTransforms(
            (pose.x, pose.y, 0.0), turn, *self._inertial
        )
        self._bullet.resetBasePositionAndOrientation(
            self.robot, position, orientation, physicsClientId=self.client
        )
        self._bullet.resetBaseVelocity(
            self.robot, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=self.client
        )
        for joint, angle in zip(self.joints, self._joint_angles(), strict=True):
            self._bullet.resetJointState(self.robot, joint, angle, 0.0, physicsClientId=self.client)
        self.set_wheel_speeds(0.0, 0.0)

    def set_wheel_speeds(self, left: float, right: float) -> None:
        """Tell the wheel motors their speeds, rad/s. At rest they are parked."""
        if left == right == 0.0:
            self._park()
            return
        if self._parked:
            self._anchor(False)
        self._bullet.setJointMotorControlArray(
            self.robot,
            self.joints,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=[left] * self._left + [right] * (len(self.joints) - self._left),
            forces=self._torques,
            physicsClientId=self.client,
        )

    def wheel_angles(self) -> tuple[float, float]:
        """Left and right, radians rolled since the start, each the mean over its side."""
        angles = self._joint_angles()
        left, right = angles[: self._left], angles[self._left :]
        return sum(left) / len(left), sum(right) / len(right)

    def set_wheel_friction(self, wheel: int, friction: float) -> None:
        """Give the n-th wheel (left ones first) the friction of the floor below it."""
        self._bullet.changeDynamics(
            self.robot, self.joints[wheel], lateralFriction=friction, physicsClientId=self.client
        )

    def truth(self) -> GroundTruth:
        """Pose and speed of the base frame in the plane. Plain numbers: it is asked often."""
        (x, y, _), r, (vx, vy, _), (_, _, spin) = self._base()
        forward = hypot(r[0], r[3])
        c, s = r[0] / forward, r[3] / forward
        twist = Twist(c * vx + s * vy, spin, c * vy - s * vx)
        return GroundTruth(Pose2D(x, y, atan2(s, c)), twist)

    def base_state(self) -> BaseState:
        """The base frame in space."""
        position, rotation, velocity, spin = self._base()
        return BaseState(
            np.array(position), np.array(rotation).reshape(3, 3), np.array(velocity), np.array(spin)
        )

    def base_pose(self) -> tuple[Vector, tuple[float, float, float, float]]:
        """Position and orientation (x, y, z, w) of the base frame, world frame."""
        com = self._bullet.getBasePositionAndOrientation(self.robot, physicsClientId=self.client)
        pose: tuple[Vector, tuple[float, float, float, float]]
        pose = self._bullet.multiplyTransforms(*com, *self._from_inertial)
        return pose

    def _base(self) -> tuple[Vector, tuple[float, ...], Vector, Vector]:
        """Position, row-major rotation, velocity and spin of the base frame.

        PyBullet speaks of the centre of mass; v = v_com + w x (base - com).
        """
        com = self._bullet.getBasePositionAndOrientation(self.robot, physicsClientId=self.client)
        velocity, spin = self._bullet.getBaseVelocity(self.robot, physicsClientId=self.client)
        origin, turn = self._bullet.multiplyTransforms(*com, *self._from_inertial)
        rx, ry, rz = (origin[n] - com[0][n] for n in range(3))
        moved = (
            velocity[0] + spin[1] * rz - spin[2] * ry,
            velocity[1] + spin[2] * rx - spin[0] * rz,
            velocity[2] + spin[0] * ry - spin[1] * rx,
        )
        return origin, self._bullet.getMatrixFromQuaternion(turn), moved, spin

    def touching(self) -> list[tuple[int, float, float]]:
        """What the robot touches but the floor: body number and x, y of the contact."""
        floor = self.scene.floor
        return [
            (point[2], point[6][0], point[6][1])
            for point in self._bullet.getContactPoints(self.robot, physicsClientId=self.client)
            if point[2] != floor and (point[8] <= 0.0 or point[9] > 0.0)
        ]

    def distance(self, reach: float) -> float:
        """Smallest distance from the robot to anything but the floor; `reach` at most."""
        nearest = reach
        for body in self.scene.obstacles:
            for point in self._bullet.getClosestPoints(
                self.robot, body, nearest, physicsClientId=self.client
            ):
                nearest = min(nearest, max(0.0, point[8]))
        return nearest

    def _joint_angles(self) -> list[float]:
        states = self._bullet.getJointStates(self.robot, self.joints, physicsClientId=self.client)
        return [state[0] for state in states]

    def _park(self) -> None:
        """Hold the wheels' angles and let their contacts stick.

        With a speed of nothing the solver's remainder lets a standing robot creep 0.1 mm and turn
        2e-4 rad a second.
        """
        self._bullet.setJointMotorControlArray(
            self.robot,
            self.joints,
            self._bullet.POSITION_CONTROL,
            targetPositions=self._joint_angles(),
            forces=self._torques,
            physicsClientId=self.client,
        )
        self._anchor(True)

    def _anchor(self, parked: bool) -> None:
        self._parked = parked
        for joint in self.joints:
            self._bullet.changeDynamics(
                self.robot, joint, frictionAnchor=int(parked), physicsClientId=self.client
            )

    def _prepare_robot(self, description: RobotDescription, friction: float) -> None:
        bullet, client, robot = self._bullet, self.client, self.robot
        wheels = description.wheels
        assert isinstance(wheels, Wheels), "only differential drives are simulated"
        links = _joints_by_name(bullet, client, robot)
        missing = [name for name in wheels.left + wheels.right if name not in links]
        if missing:
            raise BodyError(
                f"{description.urdf.name} has no wheel joint {missing[0]!r}; "
                f"it has {', '.join(sorted(links))}"
            )
        self.joints = [links[name] for name in wheels.left + wheels.right]
        self._left = len(wheels.left)
        self._parked = False
        self._inertial = bullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
        self._from_inertial = bullet.invertTransform(*self._inertial)
        every = range(-1, len(links))
        masses = [bullet.getDynamicsInfo(robot, link, physicsClientId=client)[0] for link in every]
        for link in every:
            # Bullet damps by default, which a wheel would feel as rolling resistance.
            dynamics = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
            if link in self.joints:
                dynamics["lateralFriction"] = friction
            elif self._is_caster(link):
                dynamics |= _sprung_caster(sum(masses))
            bullet.changeDynamics(robot, link, physicsClientId=client, **dynamics)
        self._torques = [_torque(description, sum(masses))] * len(self.joints)
        self.wheel_places = self._wheel_places()

    def _is_caster(self, link: int) -> bool:
        shapes = self._bullet.getCollisionShapeData(self.robot, link, physicsClientId=self.client)
        return any(shape[2] == self._bullet.GEOM_SPHERE for shape in shapes)

    def _wheel_places(self) -> FloatArray:
        """(n, 2) where the wheels touch the floor, base frame; loaded at the world's origin."""
        places = []
        for joint in self.joints:
            state = self._bullet.getLinkState(self.robot, joint, physicsClientId=self.client)
            places.append(state[4][:2])
        return np.array(places)


def load_robot(bullet: Any, client: int, urdf: FilePath) -> int:
    """A robot with its base frame at the world's origin; its body number.

    Raises:
        BodyError: there is no such file, or PyBullet cannot read it.
    """
    if not urdf.is_file():
        raise BodyError(f"there is no robot shape {urdf.name}; looked in {urdf.parent.name}/")
    try:
        with loader.stdout_as_stderr():  # where PyBullet's warnings about the file belong
            robot: int = bullet.loadURDF(
                str(urdf), flags=bullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
            )
    except bullet.error as error:
        raise BodyError(f"{urdf.name} cannot be read as a URDF: {error}") from error
    return robot


def _joints_by_name(bullet: Any, client: int, robot: int) -> dict[str, int]:
    count = bullet.getNumJoints(robot, physicsClientId=client)
    infos = [bullet.getJointInfo(robot, n, physicsClientId=client) for n in range(count)]
    return {info[1].decode(): info[0] for info in infos}


def _sprung_caster(mass: float) -> dict[str, float]:
    """Dynamics of a frictionless caster on a critically damped spring.

    Rigid casters beside rigid wheels leave it to the solver who carries the weight, and wheels
    that carry too little of it slip.
    """
    stiffness = mass * GRAVITY / CASTER_TRAVEL
    damping = 2.0 * sqrt(stiffness * mass)
    return {"lateralFriction": 0.0, "contactStiffness": stiffness, "contactDamping": damping}


def _torque(description: RobotDescription, mass: float) -> float:
    """Motor strength of one wheel: both accelerations at once, with a reserve."""
    limits, wheels = description.limits, description.wheels
    assert isinstance(wheels, Wheels), "only differential drives are simulated"
    linear = mass * max(limits.linear_acceleration, limits.linear_deceleration)
    inertia = mass * description.footprint.circumscribed_radius**2 / 2.0
    turning = 2.0 * inertia * limits.angular_acceleration / wheels.separation
    count = len(wheels.left) + len(wheels.right)
    return TORQUE_RESERVE * (linear + turning) * wheels.radius / count
