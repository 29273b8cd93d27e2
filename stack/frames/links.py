"""Poses of the links of a robot: forward kinematics along the joints of its URDF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from stack.compilation import KernelTypes
from stack.errors import FrameError
from stack.types import FloatArray, LinkJoint


class LinkChain:
    """The joints between two links, base first, with consecutive fixed ones as one transform.

    Args:
        joints: from the upper link to the lower one; they may be none.

    Attributes:
        names: of the joints that move, base first.
        fixed: (4, 4) transform behind the last of them, or of all without any.
    """

    def __init__(self, joints: Iterable[LinkJoint]) -> None:
        moving: list[LinkJoint] = []
        before, placed = np.eye(4), []
        for joint in joints:
            before = before @ joint.origin
            if joint.kind != "fixed":
                moving.append(joint)
                placed.append(before)
                before = np.eye(4)
        self.names = tuple(joint.name for joint in moving)
        self.fixed: FloatArray = before
        self._placed = np.array(placed, dtype=np.float64).reshape(-1, 4, 4)
        self._axes = np.array([joint.axis for joint in moving], dtype=np.float64).reshape(-1, 3)
        self._turns = np.array([joint.kind != "prismatic" for joint in moving], dtype=bool)

    @staticmethod
    def kernels() -> KernelTypes:
        """Compiled functions of `pose`."""
        from stack.frames.kernels import CHAIN

        return CHAIN

    def pose(self, positions: Sequence[float] | FloatArray) -> FloatArray:
        """Return the transform (4, 4) upper <- lower.

        Args:
            positions: of the joints `names`, radians or metres.
        """
        if not self.names:
            return self.fixed
        from stack.frames.kernels import chain_pose  # numba, which reading a URDF does not need

        q = np.array(positions, dtype=np.float64)
        found: FloatArray = chain_pose(self._placed, self._axes, self._turns, q, self.fixed)
        return found


class RobotLinks:
    """The tree of links of a robot.

    Args:
        joints: between the base frame and all links.
        base: name of the base frame.
    """

    def __init__(self, joints: Sequence[LinkJoint], base: str) -> None:
        self._base = base
        self._above = {joint.child: joint for joint in joints}
        self._chains: dict[str, LinkChain] = {}

    def chain(self, link: str) -> LinkChain:
        """Return the joints from the base frame to a link.

        Raises:
            FrameError: there is no such link.
        """
        if link not in self._chains:
            self._chains[link] = LinkChain(self.joints_to(link))
        return self._chains[link]

    def pose(self, link: str, positions: Mapping[str, float]) -> FloatArray:
        """Return the transform (4, 4) base <- link.

        Args:
            link: its name.
            positions: of joints by name, radians or metres; others are at 0.

        Raises:
            FrameError: there is no such link.
        """
        chain = self.chain(link)
        return chain.pose([positions.get(name, 0.0) for name in chain.names])

    def joints_to(self, link: str) -> list[LinkJoint]:
        """Return all joints from the base frame to a link.

        Raises:
            FrameError: there is no such link.
        """
        if link != self._base and link not in self._above:
            known = ", ".join((self._base, *self._above))
            raise FrameError(f"the robot has no link {link!r}; known: {known}")
        found: list[LinkJoint] = []
        while link != self._base:
            found.append(self._above[link])
            link = self._above[link].parent
        return found[::-1]
