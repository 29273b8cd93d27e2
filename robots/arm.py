"""Reader of the section `arm` of robot.yaml: chain, limits and gripper are found in the URDF.

The chain is the movable joints from the root to the link of the gripper, or to `tool`; without both
it ends where it divides. A gripper is two prismatic joints below one link that travel in opposite
directions.
Code: E304.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import inf, pi

import numpy as np

from robots.declared import ARM
from robots.urdf.model import Joint, RobotModel
from stack.documents import Mark, Node, Section
from stack.drivetrain.arm_description import (
    HOME,
    ArmDescription,
    GripperDescription,
    JointLimits,
)
from stack.parameters import Declaration, suggestion
from stack.types import FloatArray

RISE_TIME, JERK_TIME = 0.5, 0.1
"""Seconds in which a joint reaches its top speed, and its top acceleration, unless the file says
otherwise: less than what industrial arms of this size can do."""

OPPOSITE = -0.99
"""Cosine of the angle between the axes of two fingers."""

MOVABLE = ("revolute", "continuous", "prismatic")

TOOL = Declaration(
    "tool", str, "link between the finger tips, z out of the hand; default: found", default=""
)
ACCELERATION = Declaration(
    "acceleration", float | None, "of every joint, rad/s²; default: top speed in 0.5 s",
    default=None, above=0.0,
)  # fmt: skip
JERK = Declaration(
    "jerk", float | None, "of every joint, rad/s³; default: top acceleration in 0.1 s",
    default=None, above=0.0,
)  # fmt: skip
FORCE = Declaration(
    "force", float | None, "with which the fingers press at most; default: of the URDF", "N",
    default=None, above=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class _Fingers:
    """Two prismatic joints of a gripper, and the link that carries them."""

    hand: str
    joints: tuple[Joint, Joint]


def read_arm(top: Section, model: RobotModel | None) -> ArmDescription | None:
    """Read the arm; None without the section `arm`, or if something is wrong, which is reported.

    Args:
        top: the robot file.
        model: of the robot; None if its URDF cannot be read.
    """
    section = top.section("arm")
    if section is None:
        return None
    tool, acceleration, jerk = (section.value(it) for it in (TOOL, ACCELERATION, JERK))
    gripper = section.section("gripper")
    force = None if gripper is None else gripper.value(FORCE)
    if gripper is not None:
        gripper.done()
    node = section.node_of("postures")
    section.done()
    if model is None:
        return None
    found = _Finder(section, model, tool)
    chain, fingers = found.chain()
    limits = found.limits(chain, acceleration, jerk) if chain else None
    if limits is None:
        return None
    postures = _postures(section, node, chain, limits)
    if gripper is not None and fingers is None:
        sentence = "arm: the URDF has no two prismatic joints that move in opposite directions"
        section.findings.add(ARM, gripper.mark, sentence, "remove `gripper`")
    described = None if fingers is None else found.gripper(fingers, force)
    return ArmDescription(
        tuple(joint.name for joint in chain), chain[0].parent, found.tool_of(chain, fingers),
        limits, postures, described,
    )  # fmt: skip


class _Finder:
    """Finds the parts of an arm in a URDF, and reports what is missing.

    Args:
        section: `arm`.
        model: of the robot.
        tool: link of the tool as the robot file names it; empty: to be found.
    """

    def __init__(self, section: Section, model: RobotModel, tool: str) -> None:
        self._section, self._model, self._tool = section, model, tool

    def chain(self) -> tuple[list[Joint], _Fingers | None]:
        """Return the joints of the arm, base first, and the fingers at its end.

        Without any joint a finding was added.
        """
        model, tool = self._model, self._tool
        if tool and tool not in model.links:
            hint = suggestion(tool, model.links)
            self._error(f"tool: the URDF has no link {tool!r}", hint, "tool")
            return [], None
        pairs = list(self._pairs())
        if tool:
            above = {joint.parent for joint in self._model.joints_above(tool)} | {tool}
            pairs = [pair for pair in pairs if pair.hand in above]
        elif len(pairs) > 1:
            hands = ", ".join(pair.hand for pair in pairs)
            self._error(f"the URDF has several grippers, on {hands}", "name the link of one: tool")
            return [], None
        fingers = pairs[-1] if pairs else None
        end = fingers.hand if fingers is not None else tool or self._farthest()
        chain = [joint for joint in self._model.joints_above(end) if joint.kind in MOVABLE]
        if fingers is None and not tool:
            chain = self._before_branches(chain)
        if not chain:
            sentence = f"no movable joint leads from {model.root!r} to {end!r}"
            self._error(f"the URDF has no arm: {sentence}", "describe its joints in the URDF")
        return chain, fingers

    def limits(
        self, chain: list[Joint], acceleration: float | None, jerk: float | None
    ) -> JointLimits | None:
        """Return the limits of the joints; None if the URDF lacks one, which is reported.

        Args:
            chain: of the arm.
            acceleration: rad/s², of every joint; None: from the speeds.
            jerk: rad/s³, of every joint; None: from the accelerations.
        """
        rows = [self._limits_of(joint) for joint in chain]
        if any(row is None for row in rows):
            return None
        lower, upper, velocity, effort = np.array(rows, dtype=np.float64).T
        rise = velocity / RISE_TIME if acceleration is None else np.full(len(chain), acceleration)
        change = rise / JERK_TIME if jerk is None else np.full(len(chain), jerk)
        return JointLimits(lower, upper, velocity, rise, change, effort)

    def gripper(self, fingers: _Fingers, force: float | None) -> GripperDescription | None:
        """Return the gripper; None if the URDF lacks a limit of a finger, which is reported."""
        rows = [self._limits_of(joint) for joint in fingers.joints]
        if rows[0] is None or rows[1] is None:
            return None
        travel = min(row[1] for row in rows if row is not None)
        speed, effort = min(rows[0][2], rows[1][2]), min(rows[0][3], rows[1][3])
        one, other = fingers.joints
        links = (one.child, other.child)
        below = (joint.child for link in links for joint in self._model.downwards(link))
        return GripperDescription(
            (one.name, other.name), 2.0 * travel, force or effort, speed, (*links, *below)
        )

    def tool_of(self, chain: list[Joint], fingers: _Fingers | None) -> str:
        """Return the link of the tool: as named, else a link without shape fixed to the hand."""
        if self._tool or fingers is None:
            return self._tool or chain[-1].child
        fixed = [
            joint.child
            for joint in self._model.joints_below(fingers.hand)
            if joint.kind == "fixed" and not list(self._model.links[joint.child].all("collision"))
        ]
        return fixed[0] if len(fixed) == 1 else fingers.hand

    def _pairs(self) -> Iterator[_Fingers]:
        """Yield the pairs of fingers; of two the one that others mimic comes first."""
        for hand in self._model.links:
            sliding = [j for j in self._model.joints_below(hand) if j.kind == "prismatic"]
            for one, other in combinations(sliding, 2):
                axes = [(joint.origin[:3, :3] @ joint.axis) for joint in (one, other)]
                if float(axes[0] @ axes[1]) < OPPOSITE:
                    yield _Fingers(hand, (one, other))

    def _farthest(self) -> str:
        """Return the link behind the most movable joints; wheels turn endlessly and are none."""
        depth = {
            link: sum(
                joint.kind in ("revolute", "prismatic") for joint in self._model.joints_above(link)
            )
            for link in self._model.links
        }
        return max(depth, key=lambda link: depth[link])

    def _before_branches(self, chain: list[Joint]) -> list[Joint]:
        """Return the joints up to the body that carries several others: fingers of any kind."""
        for number, joint in enumerate(chain):
            if len(list(self._next(joint.child))) > 1:
                return chain[: number + 1]
        return chain

    def _next(self, link: str) -> Iterator[Joint]:
        """Yield the movable joints of the body that a link belongs to."""
        for joint in self._model.joints_below(link):
            if joint.kind in MOVABLE:
                yield joint
            else:
                yield from self._next(joint.child)

    def _limits_of(self, joint: Joint) -> tuple[float, float, float, float] | None:
        """Return lower, upper, velocity and effort; None if one is missing, which is reported."""
        element = joint.element.first("limit")
        given = {} if element is None else element.attributes
        if joint.kind == "continuous":
            given = {"lower": f"{-2.0 * pi}", "upper": f"{2.0 * pi}", **given}
        values = [_number(given.get(key, "")) for key in ("lower", "upper", "velocity", "effort")]
        lower, upper, velocity, effort = values
        if not (lower < upper and 0.0 < velocity < inf and 0.0 < effort < inf):
            sentence = f"the URDF's joint {joint.name!r} needs lower < upper, velocity and effort"
            hint = 'such as <limit lower="-2.9" upper="2.9" velocity="2.2" effort="87"/>'
            mark = joint.element.mark if element is None else element.mark
            self._section.findings.add(ARM, mark, f"arm: {sentence} above 0 in its <limit>", hint)
            return None
        return lower, upper, velocity, effort

    def _error(self, sentence: str, hint: str, key: str = "") -> None:
        mark: Mark = self._section.mark_of(key) if key else self._section.mark
        self._section.findings.add(ARM, mark, f"arm: {sentence}", hint)


def _postures(
    section: Section, node: Node | None, chain: list[Joint], limits: JointLimits
) -> dict[str, FloatArray]:
    """Read the named postures; `home` is in the middle of the limits unless it is given."""
    found = {HOME: 0.5 * (limits.lower + limits.upper)}
    for key, listed in node.entries if node is not None else ():
        name = f"postures.{key.value}"
        declared = [
            Declaration(joint.name, float, "position", "m" if joint.kind == "prismatic" else "rad")
            for joint in chain
        ]
        read = section.parts(name, listed, declared)
        if read is None:
            continue
        posture = np.array(read)
        for number, joint in enumerate(chain):
            low, high = float(limits.lower[number]), float(limits.upper[number])
            if not low <= posture[number] <= high:
                sentence = (
                    f"{name}: {joint.name} is {posture[number]:g}, beyond its limits {low:g} to "
                    f"{high:g}"
                )
                section.findings.add(ARM, listed.items[number].mark, sentence)
        found[str(key.value)] = posture
    return found


def _number(text: str) -> float:
    """Return the number in an attribute; NaN without one."""
    try:
        return float(text)
    except ValueError:
        return np.nan
