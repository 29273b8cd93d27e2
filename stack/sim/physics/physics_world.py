"""The PyBullet world with one robot in it: step, wheels, true pose and contacts.

E. Coumans and Y. Bai, PyBullet, 2016-2021. All of PyBullet's conventions stay in here; outside
there are base-frame poses and wheel angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.sim.physics import bullet as loader
from stack.sim.physics.drivetrain import STEERING_TORQUE, Drivetrain, find_drivetrain
from stack.sim.physics.scene import Scene
from stack.sim.physics.settings import SimulationSettings
from stack.sim.worlds.world import World
from stack.types import FloatArray, Pose2D, Twist

GRAVITY = 9.81

Vector = tuple[float, float, float]
CASTER_TRAVEL = 0.002
"""Metres that a caster or a wheel without motor gives way under the robot's whole weight."""

STEERING_GAIN = 0.5
"""Share of a steering error that is made up for in one physics step."""


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
    """A PyBullet client with a world's static bodies and a robot on wheels.

    Args:
        description: the robot; its URDF's root frame is the base frame on the floor.
        world: where it stands.
        start: of the base frame, world frame.
        settings: physics rate and solver iterations.

    Raises:
        BodyError: the URDF cannot be loaded, lacks one of the wheels, or has omnidirectional
            wheels whose axle is not an axis of their link.
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
        for joint, angle in zip(self.joints, self._angles(self.joints), strict=True):
            self._bullet.resetJointState(self.robot, joint, angle, 0.0, physicsClientId=self.client)
        self._park()

    def set_wheel_speeds(self, *speeds: float) -> None:
        """Tell the wheel motors their speeds, rad/s. At rest they are parked."""
        if not any(speeds):
            if not self._parked:
                self._park()
            return
        if self._parked:
            self._anchor(False)
        self._bullet.setJointMotorControlArray(
            self.robot,
            self.joints,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=self._torques,
            physicsClientId=self.client,
        )

    def steer(self, angles: Sequence[float]) -> None:
        """Turn the steered wheels, left and right, to angles in radians."""
        steered = self._drivetrain.steering
        if steered:
            self._bullet.setJointMotorControlArray(
                self.robot,
                steered,
                self._bullet.POSITION_CONTROL,
                targetPositions=angles,
                positionGains=[STEERING_GAIN] * len(steered),
                forces=[STEERING_TORQUE] * len(steered),
                physicsClientId=self.client,
            )

    def wheel_angles(self) -> list[float]:
        """Radians that each driven wheel has rolled since the start."""
        return self._angles(self.joints)

    def steering_angles(self) -> list[float]:
        """Radians that the steered wheels stand at, left and right."""
        return self._angles(self._drivetrain.steering)

    def set_wheel_friction(self, wheel: int, friction: float) -> None:
        """Give the n-th tyre, as `wheel_places` has them, the friction of the floor below."""
        link = self._drivetrain.tyres[wheel]
        self._bullet.changeDynamics(
            self.robot, link, lateralFriction=friction, physicsClientId=self.client
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

    def _angles(self, joints: list[int]) -> list[float]:
        if not joints:
            return []
        states = self._bullet.getJointStates(self.robot, joints, physicsClientId=self.client)
        return [state[0] for state in states]

    def _park(self) -> None:
        """Hold the wheels and let their contacts stick.

        With a speed of nothing the solver's remainder lets a standing robot creep 0.1 mm and turn
        2e-4 rad a second, so their angles are held. With front wheels that stand across it is the
        other way round: held angles creep 0.5 mm a second, a speed of nothing 0.01 mm.
        """
        bullet = self._bullet
        still: dict[str, Any] = {
            "controlMode": bullet.POSITION_CONTROL, "targetPositions": self._angles(self.joints)
        }  # fmt: skip
        if self._drivetrain.steering:
            still = {
                "controlMode": bullet.VELOCITY_CONTROL, "targetVelocities": [0.0] * len(self.joints)
            }  # fmt: skip
        bullet.setJointMotorControlArray(
            self.robot, self.joints, **still, forces=self._torques, physicsClientId=self.client
        )
        self._anchor(True)

    def _anchor(self, parked: bool) -> None:
        self._parked = parked
        for joint in self.joints:
            self._bullet.changeDynamics(
                self.robot, joint, frictionAnchor=int(parked), physicsClientId=self.client
            )
        self._brake(self._drivetrain.torque if parked else 0.0)

    def _brake(self, torque: float) -> None:
        """Hold the wheels without motor; PyBullet holds every joint until it is told not to."""
        for joint in self._drivetrain.rolling:
            self._bullet.setJointMotorControl2(
                self.robot, joint, self._bullet.VELOCITY_CONTROL, targetVelocity=0.0, force=torque,
                physicsClientId=self.client,
            )  # fmt: skip

    def _prepare_robot(self, description: RobotDescription, friction: float) -> None:
        bullet, client, robot = self._bullet, self.client, self.robot
        self._drivetrain = drivetrain = find_drivetrain(description, bullet, client, robot)
        self.joints = drivetrain.driven
        self._parked = False
        self._inertial = bullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
        self._from_inertial = bullet.invertTransform(*self._inertial)
        for link in range(-1, bullet.getNumJoints(robot, physicsClientId=client)):
            # Bullet damps by default, which a wheel would feel as rolling resistance.
            dynamics = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
            if link in drivetrain.driven:
                dynamics["lateralFriction"] = friction
            elif link in drivetrain.rolling:
                dynamics |= _sprung(drivetrain.mass) | {"lateralFriction": friction}
            elif self._is_caster(link):
                dynamics |= _sprung(drivetrain.mass) | {"lateralFriction": 0.0}
            bullet.changeDynamics(robot, link, physicsClientId=client, **dynamics)
        self._torques = [drivetrain.torque] * len(self.joints)
        if drivetrain.rollers:
            self._put_rollers_on(drivetrain)
        self.steer([0.0] * len(drivetrain.steering))
        self.wheel_places = self._wheel_places()

    def _put_rollers_on(self, drivetrain: Drivetrain) -> None:
        """Let the driven wheels slide freely along their axles, as omnidirectional ones do.

        Friction without a share along the axle stands for rollers. It stays that way however far
        the wheel has rolled, since the axle is an axis of the wheel's own frame. Bullet's friction
        cone takes the two friction directions of a contact for right-angled, which they no longer
        are: a pyramid takes the cone's place.
        """
        bullet, client = self._bullet, self.client
        bullet.setPhysicsEngineParameter(enableConeFriction=0, physicsClientId=client)
        for joint in drivetrain.driven:
            info = bullet.getJointInfo(self.robot, joint, physicsClientId=client)
            shares = [round(1.0 - abs(part), 6) for part in info[13]]
            if sorted(shares) != [0.0, 1.0, 1.0]:
                raise BodyError(
                    f"the axle of the wheel joint {info[1].decode()!r} is {info[13]}, expected an "
                    "axis of its link; turn the joint's origin instead, and its axis is 0 1 0"
                )
            bullet.changeDynamics(
                self.robot, joint, anisotropicFriction=shares, physicsClientId=client
            )

    def _is_caster(self, link: int) -> bool:
        shapes = self._bullet.getCollisionShapeData(self.robot, link, physicsClientId=self.client)
        return any(shape[2] == self._bullet.GEOM_SPHERE for shape in shapes)

    def _wheel_places(self) -> FloatArray:
        """(n, 2) where the tyres touch the floor, base frame; loaded at the world's origin."""
        places = []
        for joint in self._drivetrain.tyres:
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


def _sprung(mass: float) -> dict[str, float]:
    """Dynamics of a contact on a critically damped spring.

    Rigid casters beside rigid wheels leave it to the solver who carries the weight, and wheels
    that carry too little of it slip.
    """
    stiffness = mass * GRAVITY / CASTER_TRAVEL
    damping = 2.0 * sqrt(stiffness * mass)
    return {"contactStiffness": stiffness, "contactDamping": damping}
