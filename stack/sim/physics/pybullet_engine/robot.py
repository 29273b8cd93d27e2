"""One robot in a PyBullet world: base, wheels, true pose and contacts.

PyBullet's conventions (centre-of-mass poses, joint numbers) stay inside this module; its interface
uses base-frame poses and wheel angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.sim.physics.engine import GRAVITY, BaseState, PhysicsRobot, Touch
from stack.sim.physics.meshes import file_name
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.arm import BulletArm
from stack.sim.physics.pybullet_engine.drive_joints import (
    STEERING_TORQUE,
    DriveJoints,
    find_drive_joints,
)
from stack.sim.physics.pybullet_engine.scene import Scene
from stack.types import FloatArray, Pose2D

CASTER_TRAVEL = 0.002
"""Deflection, metres, of a caster or a wheel without motor under the whole robot's weight."""

STEERING_GAIN = 0.5
"""Share of the steering error that is corrected in one physics step."""


class BulletRobot(PhysicsRobot):
    """A robot in a PyBullet world.

    Args:
        scene: to load it into.
        description: the robot; the root frame of its model is the base frame, on the floor.
        start: pose of the base frame, world frame.
        friction: of the floor outside the friction zones.

    Raises:
        BodyError: the URDF cannot be loaded, has no joint for one of the wheels, or has an
            omnidirectional wheel whose axle is not an axis of its link.

    Attributes:
        client: number of the PyBullet client.
        body: its body number.
        joints: of the driven wheels.
    """

    _has_motors: bool

    def __init__(
        self, scene: Scene, description: RobotDescription, start: Pose2D, friction: float
    ) -> None:
        self._description, self._start, self._friction = description, start, friction
        self.load(scene)

    def load(self, scene: Scene) -> None:
        """Load the robot into a scene, at its start."""
        self._scene, self._bullet, self.client = scene, scene.bullet, scene.client
        self._state: BaseState | None = None
        self._slides = False
        described = self._description
        self.body = load_robot(
            self._bullet, self.client, described.model, fixed=not described.drivetrain.moves
        )
        self._arm = None
        if described.arm is not None:
            self._arm = BulletArm(self._bullet, self.client, self.body, described.arm)
        self.arm = self._arm
        self._prepare_robot(self._description, self._friction)
        self.place(self._start)
        scene.add_robot(self.body, self._description.name)

    def note_step(self) -> None:
        """Forget the state of before a physics step."""
        self._state = None
        if self._arm is not None:
            self._arm.refresh_contacts()

    def place(self, pose: Pose2D) -> None:
        """Place the robot at a pose, at rest, with wheels at rest."""
        self._state = None
        turn = (0.0, 0.0, sin(pose.heading / 2.0), cos(pose.heading / 2.0))
        position, orientation = self._bullet.multiplyTransforms(
            (pose.x, pose.y, 0.0), turn, *self._inertial
        )
        self._bullet.resetBasePositionAndOrientation(
            self.body, position, orientation, physicsClientId=self.client
        )
        self._bullet.resetBaseVelocity(
            self.body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=self.client
        )
        for joint, angle in zip(self.joints, self._angles(self.joints), strict=True):
            self._bullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=self.client)
        self._park()

    def set_wheel_speeds(self, *speeds: float) -> None:
        """Set the target speeds of the wheel motors, rad/s. All zero: park the wheels."""
        if not any(speeds) and (self._parked or not self._slides):
            if not self._parked:
                self._park()
            return
        if self._parked:
            self._anchor(False)
        self._set_motors(speeds, self._torques)

    def set_wheel_torques(self, *torques: float) -> None:
        """Drive the wheels with torques, N m; their motors have no speed of their own any more."""
        if self._parked:
            self._anchor(False)
        if self._has_motors:
            self._set_motors([0.0] * len(self.joints), [0.0] * len(self.joints))
            self._has_motors = False
        self._bullet.setJointMotorControlArray(
            self.body,
            self.joints,
            self._bullet.TORQUE_CONTROL,
            forces=torques,
            physicsClientId=self.client,
        )

    def wheel_speeds(self) -> list[float]:
        """Return the speeds of the driven wheels, rad/s."""
        states = self._bullet.getJointStates(self.body, self.joints, physicsClientId=self.client)
        return [state[1] for state in states]

    def _set_motors(self, speeds: Sequence[float], torques: Sequence[float]) -> None:
        self._has_motors = True
        self._bullet.setJointMotorControlArray(
            self.body,
            self.joints,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=torques,
            physicsClientId=self.client,
        )

    def steer(self, angles: Sequence[float]) -> None:
        """Set the target angles of the steered wheels, left and right, radians."""
        steered = self._wheels.steering
        if steered:
            self._bullet.setJointMotorControlArray(
                self.body,
                steered,
                self._bullet.POSITION_CONTROL,
                targetPositions=angles,
                positionGains=[STEERING_GAIN] * len(steered),
                forces=[STEERING_TORQUE] * len(steered),
                physicsClientId=self.client,
            )

    def wheel_angles(self) -> list[float]:
        """Return the angle that each driven wheel has rolled since the start, radians."""
        return self._angles(self.joints)

    def steering_angles(self) -> list[float]:
        """Return the angles of the steered wheels, left and right, radians."""
        return self._angles(self._wheels.steering)

    def set_wheel_friction(self, wheel: int, friction: float) -> None:
        """Set the friction of a wheel, counted as in `wheel_places`."""
        self._tyre_friction[wheel] = friction
        if not self._slides:
            self._apply_friction(wheel, friction)

    def _apply_friction(self, wheel: int, friction: float) -> None:
        link = self._wheels.tyres[wheel]
        self._bullet.changeDynamics(
            self.body, link, lateralFriction=friction, physicsClientId=self.client
        )

    def slide(self) -> None:
        """Take the friction from the tyres: the wheels no longer hold or move the body."""
        self._slides = True
        self._anchor(False)
        for wheel in range(len(self._wheels.tyres)):
            self._apply_friction(wheel, 0.0)

    def grip(self) -> None:
        """Give the tyres their friction back after `slide`."""
        self._slides = False
        for wheel, friction in enumerate(self._tyre_friction):
            self._apply_friction(wheel, friction)

    def set_velocity(self, x: float, y: float, spin: float) -> None:
        """Set the velocity of the base frame: m/s in the world frame, rad/s."""
        position, _, _, (_, _, vz), (wx, wy, _) = self.base_state()
        com = self._bullet.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        rx, ry = com[0][0] - position[0], com[0][1] - position[1]
        self._bullet.resetBaseVelocity(
            self.body, (x - spin * ry, y + spin * rx, vz), (wx, wy, spin),
            physicsClientId=self.client,
        )  # fmt: skip
        self._state = None

    def base_state(self) -> BaseState:
        """Return the state of the base frame in space; computed once in a physics step.

        PyBullet gives it for the centre of mass; v = v_com + w x (base - com).
        """
        if self._state is not None:
            return self._state
        com = self._bullet.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        velocity, spin = self._bullet.getBaseVelocity(self.body, physicsClientId=self.client)
        origin, turn = self._bullet.multiplyTransforms(*com, *self._from_inertial)
        (x, y, z), centre = origin, com[0]
        rx, ry, rz = x - centre[0], y - centre[1], z - centre[2]
        base_velocity = (
            velocity[0] + spin[1] * rz - spin[2] * ry,
            velocity[1] + spin[2] * rx - spin[0] * rz,
            velocity[2] + spin[0] * ry - spin[1] * rx,
        )
        rotation = self._bullet.getMatrixFromQuaternion(turn)
        self._state = BaseState(origin, turn, rotation, base_velocity, spin)
        return self._state

    def touching(self) -> list[Touch]:
        """Return the contacts except those with the floor."""
        scene = self._scene
        return [
            Touch(
                scene.obstacles[point[2]], point[6][:2], max(0.0, -point[8]),
                scene.is_person(point[2]), self._arm_link(point[3]),
            )
            for point in self._bullet.getContactPoints(self.body, physicsClientId=self.client)
            if point[2] != scene.floor and (point[8] <= 0.0 or point[9] > 0.0)
            and not self._grasps(point)
        ]  # fmt: skip

    def _grasps(self, point: Sequence[Any]) -> bool:
        """Whether a contact is one of a finger with a block: what fingers are for."""
        fingers = frozenset() if self._arm is None else self._arm.fingers
        return point[3] in fingers and self._scene.is_block(point[2])

    def _arm_link(self, link: int) -> str:
        """Return the name of a link of the arm; empty for others."""
        if self._arm is None or link not in self._arm.links:
            return ""
        info = self._bullet.getJointInfo(self.body, link, physicsClientId=self.client)
        name: str = info[12].decode()
        return name

    def distance(self, reach: float) -> float:
        """Return the distance from the robot to the nearest obstacle, metres, at most `reach`.

        The links of its arm do not count, and blocks neither: the arm handles them.
        """
        nearest = reach
        arm = frozenset() if self._arm is None else self._arm.links
        for body in self._scene.obstacles_of(self.body):
            if arm and self._scene.is_block(body):
                continue
            for point in self._bullet.getClosestPoints(
                self.body, body, nearest, physicsClientId=self.client
            ):
                if point[3] not in arm:
                    nearest = min(nearest, max(0.0, point[8]))
        return nearest

    def _angles(self, joints: list[int]) -> list[float]:
        if not joints:
            return []
        states = self._bullet.getJointStates(self.body, joints, physicsClientId=self.client)
        return [state[0] for state in states]

    def _park(self) -> None:
        """Hold the wheels and enable friction anchors at their contacts.

        With velocity control at speed 0, residual errors of the solver let a standing robot creep
        0.1 mm and 2e-4 rad per second, so position control holds the wheel angles. With steered
        front wheels it is the reverse: position control creeps 0.5 mm per second, velocity
        control 0.01 mm.
        """
        bullet = self._bullet
        self._has_motors = True
        if not self.joints:
            self._anchor(True)
            return
        hold: dict[str, Any] = {
            "controlMode": bullet.POSITION_CONTROL, "targetPositions": self._angles(self.joints)
        }  # fmt: skip
        if self._wheels.steering:
            hold = {
                "controlMode": bullet.VELOCITY_CONTROL, "targetVelocities": [0.0] * len(self.joints)
            }  # fmt: skip
        bullet.setJointMotorControlArray(
            self.body, self.joints, **hold, forces=self._torques, physicsClientId=self.client
        )
        self._anchor(True)

    def _anchor(self, parked: bool) -> None:
        self._parked = parked
        for joint in self.joints:
            self._bullet.changeDynamics(
                self.body, joint, frictionAnchor=int(parked), physicsClientId=self.client
            )
        self._brake(self._wheels.torque if parked else 0.0)

    def _brake(self, torque: float) -> None:
        """Set the braking torque, N m, of the wheels without motor.

        PyBullet brakes every joint by default; 0 lets the wheels roll.
        """
        for joint in self._wheels.rolling:
            self._bullet.setJointMotorControl2(
                self.body, joint, self._bullet.VELOCITY_CONTROL, targetVelocity=0.0, force=torque,
                physicsClientId=self.client,
            )  # fmt: skip

    def _prepare_robot(self, description: RobotDescription, friction: float) -> None:
        bullet, client, robot = self._bullet, self.client, self.body
        self._wheels = wheels = find_drive_joints(description, bullet, client, robot)
        self.joints = wheels.driven
        self._parked, self._has_motors = False, True
        of_arm = frozenset() if self._arm is None else self._arm.links
        self._inertial = bullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
        self._from_inertial = bullet.invertTransform(*self._inertial)
        for link in range(-1, bullet.getNumJoints(robot, physicsClientId=client)):
            # Bullet's default damping would act as rolling resistance.
            dynamics = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
            if link in wheels.driven:
                dynamics["lateralFriction"] = friction
            elif link in wheels.rolling:
                dynamics |= _spring_contact(wheels.mass) | {"lateralFriction": friction}
            elif link not in of_arm and self._is_caster(link):
                dynamics |= _spring_contact(wheels.mass) | {"lateralFriction": 0.0}
            bullet.changeDynamics(robot, link, physicsClientId=client, **dynamics)
        self._torques = [wheels.torque] * len(self.joints)
        if wheels.rollers:
            self._set_roller_friction(wheels)
        self.steer([0.0] * len(wheels.steering))
        self.wheel_places = self._wheel_places()
        self._tyre_friction = [friction] * len(wheels.tyres)

    def _set_roller_friction(self, wheels: DriveJoints) -> None:
        """Let the driven wheels slide freely along their axles, as omnidirectional wheels do.

        Rollers are modelled by anisotropic friction with no friction along the axle. The axle is
        an axis of the wheel's own frame, so this holds at every wheel angle. Bullet's friction
        cone assumes that the two friction directions of a contact are perpendicular, which they
        are not here; the friction pyramid is used instead.
        """
        bullet, client = self._bullet, self.client
        bullet.setPhysicsEngineParameter(enableConeFriction=0, physicsClientId=client)
        for joint in wheels.driven:
            info = bullet.getJointInfo(self.body, joint, physicsClientId=client)
            shares = [round(1.0 - abs(part), 6) for part in info[13]]
            if sorted(shares) != [0.0, 1.0, 1.0]:
                raise BodyError(
                    f"the axle of the wheel joint {info[1].decode()!r} is {info[13]}, expected an "
                    "axis of its link; rotate the joint's <origin> and use the axis 0 1 0"
                )
            bullet.changeDynamics(
                self.body, joint, anisotropicFriction=shares, physicsClientId=client
            )

    def _is_caster(self, link: int) -> bool:
        shapes = self._bullet.getCollisionShapeData(self.body, link, physicsClientId=self.client)
        return any(shape[2] == self._bullet.GEOM_SPHERE for shape in shapes)

    def _wheel_places(self) -> FloatArray:
        """Return the contact points (n, 2) of the wheels, base frame, metres.

        Valid only while the robot stands at the world's origin, as after loading.
        """
        places = []
        for joint in self._wheels.tyres:
            state = self._bullet.getLinkState(self.body, joint, physicsClientId=self.client)
            places.append(state[4][:2])
        return np.array(places, dtype=np.float64).reshape(-1, 2)


def load_robot(bullet: Any, client: int, model: str, flags: int = 0, *, fixed: bool = False) -> int:
    """Load a robot with its base frame at the world's origin and return its body number.

    Args:
        bullet: the pybullet module.
        client: number of the physics client.
        model: text of the URDF.
        flags: more of PyBullet's for `loadURDF`.
        fixed: whether nothing can move its base.

    Raises:
        BodyError: PyBullet cannot read it.
    """
    with TemporaryDirectory(prefix="treepilot-") as folder:
        file = FilePath(folder) / file_name(model, "urdf")
        file.write_text(model, "utf-8")
        try:
            with loader.stdout_as_stderr():  # PyBullet prints warnings about the file to stdout
                flags |= bullet.URDF_USE_INERTIA_FROM_FILE
                robot: int = bullet.loadURDF(
                    str(file), useFixedBase=fixed, flags=flags, physicsClientId=client
                )
        except bullet.error as error:
            raise BodyError(f"the robot's URDF cannot be loaded by PyBullet: {error}") from error
    return robot


def _spring_contact(mass: float) -> dict[str, float]:
    """Return contact dynamics of a critically damped spring.

    With rigid casters and rigid wheels the load distribution is undetermined and left to the
    solver; wheels that carry too little load slip.
    """
    stiffness = mass * GRAVITY / CASTER_TRAVEL
    damping = 2.0 * sqrt(stiffness * mass)
    return {"contactStiffness": stiffness, "contactDamping": damping}
