"""Tree of frames: rigid transforms in space, fixed ones, joints, and others that move with time.

A transform `target <- source` is a (4, 4) array, metres, that takes points of the source frame to
the target frame. Frames follow REP 105: map -> odom -> base -> sensors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from stack.errors import FrameError
from stack.frames.links import LinkChain
from stack.types import FloatArray, LinkJoint, Pose2D

FIXED = "fixed"
"""Kind of a joint that does not move."""

NO_AXIS: FloatArray = np.zeros(3)

Moving = Callable[[float], FloatArray]
"""Returns the transform parent <- child at a stamp in seconds; FrameError if it is not known."""


Positions = Callable[[float], Mapping[str, float]]
"""Returns the positions of joints by name at a stamp in seconds; FrameError if not known."""

Step = LinkChain | Moving


def at_rest(stamp: float) -> Mapping[str, float]:
    """All joints at 0, at any time."""
    return {}


@dataclass(frozen=True)
class _Route:
    """The steps from the lowest common frame down to target and to source."""

    to_target: tuple[Step, ...]
    to_source: tuple[Step, ...]


class FrameTree:
    """Frames with one parent each.

    Args:
        positions: of the joints between them.
    """

    def __init__(self, positions: Positions = at_rest) -> None:
        self._above: dict[str, tuple[str, Moving | LinkJoint]] = {}
        self._positions = positions
        self._routes: dict[tuple[str, str], _Route] = {}

    def fix(self, parent: str, child: str, transform: FloatArray) -> None:
        """Add a frame that does not move in its parent.

        Raises:
            FrameError: it has another parent, or the frames would form a loop.
        """
        self.join(LinkJoint(f"{parent}_to_{child}", FIXED, parent, child, transform, NO_AXIS))

    def join(self, joint: LinkJoint) -> None:
        """Add the frame below a joint of a robot.

        Raises:
            FrameError: as `fix`.
        """
        self._add(joint.parent, joint.child, joint)

    def follow(self, parent: str, child: str, at: Moving) -> None:
        """Add a frame that moves in its parent, as odometry measures it.

        Raises:
            FrameError: as `fix`.
        """
        self._add(parent, child, at)

    def _add(self, parent: str, child: str, at: Moving | LinkJoint) -> None:
        known = self.parent_of(child)
        if known not in (None, parent):
            raise FrameError(f"the frame {child!r} has two parents, {known!r} and {parent!r}")
        if child in self._upwards(parent):
            raise FrameError(f"the frames {parent!r} and {child!r} are above each other")
        self._above[child] = parent, at
        self._routes.clear()

    def parent_of(self, frame: str) -> str | None:
        """Return the frame in which one was added; None if it has none."""
        return self._above[frame][0] if frame in self._above else None

    @property
    def names(self) -> frozenset[str]:
        """All frames."""
        return frozenset(self._above).union(parent for parent, _ in self._above.values())

    def lookup(self, target: str, source: str, stamp: float = 0.0) -> FloatArray:
        """Return the transform (4, 4) target <- source.

        Args:
            target: frame in which points shall be.
            source: frame in which points are.
            stamp: seconds; fixed frames have the same transform at any.

        Raises:
            FrameError: a frame is unknown, nothing connects them, or a moving frame between them
                is not known at the stamp.
        """
        route = self._routes.get((target, source))
        if route is None:
            route = self._routes[target, source] = self._route(target, source)
        try:
            there = self._down(route.to_source, stamp)
            if not route.to_target:
                return there
            found: FloatArray = inverse(self._down(route.to_target, stamp)) @ there
        except FrameError as error:
            raise FrameError(f"{target} <- {source}: {error}") from None
        return found

    def joint_to(self, frame: str) -> LinkJoint | None:
        """Return the joint above a frame; None if there is none, or it moves without one."""
        above = self._above.get(frame)
        return above[1] if above is not None and isinstance(above[1], LinkJoint) else None

    def _route(self, target: str, source: str) -> _Route:
        """Return how to get from one frame to another.

        Raises:
            FrameError: one is unknown, or nothing connects them.
        """
        for name in (target, source):
            if name not in self.names:
                known = ", ".join(sorted(self.names)) or "none"
                raise FrameError(f"there is no frame {name!r}; known: {known}")
        here, there = self._upwards(target), self._upwards(source)
        if here[-1] != there[-1]:
            raise FrameError(
                f"no transform connects {source!r} with {target!r}: one is below {there[-1]!r}, "
                f"the other below {here[-1]!r}"
            )
        while len(here) > 1 and len(there) > 1 and here[-2] == there[-2]:
            here.pop()
            there.pop()
        return _Route(self._steps(here), self._steps(there))

    def _upwards(self, frame: str) -> list[str]:
        """Return a frame and all above it."""
        found = [frame]
        while found[-1] in self._above:
            found.append(self._above[found[-1]][0])
        return found

    def _steps(self, upwards: list[str]) -> tuple[Step, ...]:
        """Return the steps down to the first frame of a list from its last; joints as chains."""
        steps: list[Step] = []
        joints: list[LinkJoint] = []
        for child in reversed(upwards[:-1]):
            step = self._above[child][1]
            if isinstance(step, LinkJoint):
                joints.append(step)
                continue
            steps += [LinkChain(joints)] if joints else []
            steps.append(step)
            joints = []
        return (*steps, LinkChain(joints)) if joints else tuple(steps)

    def _down(self, steps: tuple[Step, ...], stamp: float) -> FloatArray:
        """Return the transform from above the first step to below the last."""
        found = None
        for step in steps:
            if not isinstance(step, LinkChain):
                pose = step(stamp)
            elif step.names:
                positions = self._positions(stamp)
                pose = step.pose([positions.get(name, 0.0) for name in step.names])
            else:
                pose = step.fixed
            found = pose if found is None else found @ pose
        return np.eye(4) if found is None else found


def inverse(transform: FloatArray) -> FloatArray:
    """Return the transform (4, 4) source <- target of target <- source."""
    found = np.eye(4)
    found[:3, :3] = transform[:3, :3].T
    found[:3, 3] = -transform[:3, :3].T @ transform[:3, 3]
    return found


def lifted(pose: Pose2D) -> FloatArray:
    """Return the transform (4, 4) of a pose on the floor."""
    c, s = cos(pose.heading), sin(pose.heading)
    found = np.eye(4)
    found[:2, :2] = [[c, -s], [s, c]]
    found[:2, 3] = pose.x, pose.y
    return found
