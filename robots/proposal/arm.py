"""Proposes the section `arm` of a robot.yaml for a URDF that contains an arm."""

from __future__ import annotations

from robots.arm import read_arm
from robots.declared import SHAPE
from robots.urdf.model import RobotModel
from stack.documents import Findings, Section
from stack.documents.reader import read_text
from stack.drivetrain.arm_description import HOME, ArmDescription

LEAST_JOINTS = 4
"""Joints in series that make an arm: steered wheels, casters and legs have fewer."""

LIMITED = ("revolute", "prismatic")


def propose_arm(model: RobotModel) -> ArmDescription | None:
    """Return the arm in a URDF; None without one.

    Raises:
        InputError: it has several grippers, or a joint of the arm lacks a limit.
    """
    if not _has_arm(model):
        return None
    findings = Findings()
    file = read_text("arm: {}", model.element.mark.file)
    arm = read_arm(Section(file, findings, "a proposal", SHAPE), model)
    findings.raise_errors()
    return arm


def arm_lines(arm: ArmDescription) -> list[str]:
    """Return the lines of the section."""
    home = ", ".join(f"{round(position, 3) + 0.0:g}" for position in arm.postures[HOME].tolist())
    joints = f"{arm.joints[0]} to {arm.joints[-1]}" if len(arm.joints) > 1 else arm.joints[0]
    lines = [
        f"arm:                                 # {len(arm.joints)} joints, {joints}",
        f"  tool: {arm.tool_link}",
        "  postures:",
        "    # the middle of the limits: choose one that is out of the way, and free",
        f"    home: [{home}]",
    ]
    if arm.gripper is not None:
        width, fingers = 1e3 * arm.gripper.width_max, " and ".join(arm.gripper.joints)
        lines += [
            f"  gripper:                           # {fingers}, {width:.0f} mm wide",
            f"    force: {arm.gripper.force_max:g} N",
        ]
    return lines


def _has_arm(model: RobotModel) -> bool:
    """Whether some link has enough joints with limits above it."""
    chains = (model.joints_above(link) for link in model.links)
    return any(sum(it.kind in LIMITED for it in chain) >= LEAST_JOINTS for chain in chains)
