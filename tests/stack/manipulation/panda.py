"""Franka's Panda from pybullet_data, with the limits of its data sheet."""

from functools import cache
from pathlib import Path

import numpy as np
import pybullet_data

from stack.drivetrain.arm_description import ArmDescription, GripperDescription, JointLimits
from stack.manipulation.model import ArmModel

URDF = Path(pybullet_data.getDataPath()) / "franka_panda/panda.urdf"

HOME = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


def posed(*offsets: float) -> np.ndarray:
    """Return positions by their difference to those of the home posture."""
    return HOME + np.array(offsets)


LIMITS = JointLimits(
    lower=np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]),
    upper=np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]),
    velocity=np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]),
    acceleration=np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]) / 2.0,
    jerk=np.array([150.0, 75.0, 100.0, 125.0, 150.0, 200.0, 200.0]),
    effort=np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0]),
)

PANDA = ArmDescription(
    joints=tuple(f"panda_joint{number}" for number in range(1, 8)),
    base_link="panda_link0",
    tool_link="panda_grasptarget",
    limits=LIMITS,
    postures={"home": HOME},
    gripper=GripperDescription(
        joints=("panda_finger_joint1", "panda_finger_joint2"),
        width_max=0.08,
        force_max=70.0,
        speed=0.1,
        finger_links=("panda_leftfinger", "panda_rightfinger"),
    ),
)


@cache
def panda() -> ArmModel:
    """Return the model, read once."""
    return ArmModel(URDF, PANDA)
