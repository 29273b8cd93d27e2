"""An arm with its gripper in a PyBullet world: motors and states of joints and fingers."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos
from typing import Any

import numpy as np

from stack.drivetrain.arm_description import HOME, ArmDescription, GripperDescription
from stack.errors import BodyError
from stack.sim.physics.engine import FingerState, JointReading, PhysicsArm

POSITION_GAIN, VELOCITY_GAIN = 0.2, 1.0
"""Shares of the errors of position and velocity that a motor corrects in one physics step."""

FINGER_FRICTION, SPINNING_FRICTION = 1.0, 0.01
"""Of the finger tips; Bullet multiplies it by that of what they hold."""

STALE_TURN = 0.1
"""Radians by which the hand turns before the contacts of its fingers are found again. Bullet keeps
a contact with its direction in the world for as long as its points stay together, and what is held
turns with the hand: old contacts would press from directions in which nothing is."""

DEFAULT_GROUP, ALL_GROUPS = 1, -1
"""Collision group and mask of everything that moves."""

GEAR_FORCE, GEAR_CORRECTION = 50.0, 0.1
"""Force, N, with which the fingers are kept at equal distances from the middle, and the share of
their difference that is corrected in a physics step: a grasp does not hold without it."""


class BulletArm(PhysicsArm):
    """Motors of an arm.

    Args:
        bullet: the pybullet module.
        client: number of the physics client.
        body: body number of the robot.
        description: of the arm.

    Raises:
        BodyError: the robot has no such joint.
    """

    def __init__(self, bullet: Any, client: int, body: int, description: ArmDescription) -> None:
        self._bullet, self._client, self._body = bullet, client, body
        numbers = joint_numbers(bullet, client, body)
        missing = [name for name in description.all_joints if name not in numbers]
        if missing:
            raise BodyError(f"the robot's URDF has no joint {missing[0]!r} of its arm")
        self._joints = [numbers[name] for name in description.joints]
        self._efforts = description.limits.effort.tolist()
        self._gripper = description.gripper
        self._fingers = [numbers[name] for name in _finger_names(description.gripper)]
        self._turn = (0.0, 0.0, 0.0, 1.0)  # of the hand when the contacts were found
        count = len(self._joints)
        self._gains = [POSITION_GAIN] * count, [VELOCITY_GAIN] * count
        self.place(description.postures[HOME].tolist())
        if self._gripper is not None:
            self._prepare_fingers(self._gripper)

    @property
    def links(self) -> frozenset[int]:
        """Numbers of the links that the joints of arm and gripper move."""
        return frozenset((*self._joints, *self._fingers))

    @property
    def fingers(self) -> frozenset[int]:
        """Numbers of the links of the fingers."""
        return frozenset(self._fingers)

    def place(self, positions: Sequence[float]) -> None:
        """As in `PhysicsArm`."""
        for joint, position in zip(self._joints, positions, strict=True):
            self._bullet.resetJointState(
                self._body, joint, position, 0.0, physicsClientId=self._client
            )
        self.drive(positions, [0.0] * len(self._joints))

    def drive(self, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """As in `PhysicsArm`."""
        self._bullet.setJointMotorControlArray(
            self._body,
            self._joints,
            self._bullet.POSITION_CONTROL,
            targetPositions=positions,
            targetVelocities=velocities,
            positionGains=self._gains[0],
            velocityGains=self._gains[1],
            forces=self._efforts,
            physicsClientId=self._client,
        )

    def joints(self) -> JointReading:
        """As in `PhysicsArm`."""
        states = self._bullet.getJointStates(self._body, self._joints, physicsClientId=self._client)
        rows = np.array([(state[0], state[1], state[3]) for state in states], dtype=np.float64)
        return JointReading(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy())

    def move_fingers(self, width: float, force: float) -> None:
        """As in `PhysicsArm`."""
        if self._gripper is None:
            return
        travel = min(max(width, 0.0), self._gripper.width_max) / 2.0
        for joint in self._fingers:
            self._bullet.setJointMotorControl2(
                self._body, joint, self._bullet.POSITION_CONTROL, targetPosition=travel,
                force=min(force, self._gripper.force_max), maxVelocity=self._gripper.speed,
                physicsClientId=self._client,
            )  # fmt: skip

    def finger_state(self) -> FingerState:
        """As in `PhysicsArm`: the force is the smaller one of both fingers."""
        states = self._bullet.getJointStates(
            self._body, self._fingers, physicsClientId=self._client
        )
        pressed = [
            sum(
                point[9]
                for point in self._bullet.getContactPoints(
                    bodyA=self._body, linkIndexA=finger, physicsClientId=self._client
                )
                if point[2] != self._body
            )
            for finger in self._fingers
        ]
        return FingerState(
            float(sum(state[0] for state in states)),
            float(max(abs(state[1]) for state in states)),
            float(min(pressed)),
        )

    def refresh_contacts(self) -> None:
        """Find the contacts of the fingers again if the hand has turned; after physics steps."""
        if not self._fingers:
            return
        turn = self._bullet.getLinkState(
            self._body, self._fingers[0], physicsClientId=self._client
        )[1]
        same = abs(sum(now * before for now, before in zip(turn, self._turn, strict=True)))
        if same > cos(STALE_TURN / 2.0):
            return
        self._turn = turn
        for finger in self._fingers:  # the same groups as before: that drops its contacts
            self._bullet.setCollisionFilterGroupMask(
                self._body, finger, DEFAULT_GROUP, ALL_GROUPS, physicsClientId=self._client
            )

    def _prepare_fingers(self, gripper: GripperDescription) -> None:
        """Open the fingers, and let both travel equally far."""
        bullet, body, client = self._bullet, self._body, self._client
        for finger in self._fingers:
            bullet.resetJointState(
                body, finger, gripper.width_max / 2.0, 0.0, physicsClientId=client
            )
            bullet.changeDynamics(
                body, finger, lateralFriction=FINGER_FRICTION,
                spinningFriction=SPINNING_FRICTION, physicsClientId=client,
            )  # fmt: skip
        one, other = self._fingers
        gear = bullet.createConstraint(
            body, one, body, other, bullet.JOINT_GEAR, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0), physicsClientId=client,
        )  # fmt: skip
        bullet.changeConstraint(
            gear, gearRatio=-1.0, erp=GEAR_CORRECTION, maxForce=GEAR_FORCE, physicsClientId=client
        )
        self.move_fingers(gripper.width_max, gripper.force_max)


def joint_numbers(bullet: Any, client: int, body: int) -> dict[str, int]:
    """Return the numbers of a robot's joints, which are those of their child links, by name."""
    count = bullet.getNumJoints(body, physicsClientId=client)
    infos = (bullet.getJointInfo(body, n, physicsClientId=client) for n in range(count))
    return {info[1].decode(): info[0] for info in infos}


def _finger_names(gripper: GripperDescription | None) -> tuple[str, ...]:
    return () if gripper is None else gripper.joints
