"""Tree of frames: rigid transforms in space, fixed ones and those that change with time.

A transform `target <- source` is a (4, 4) array, metres, that takes points of the source frame to
the target frame. Frames follow REP 105: map -> odom -> base -> sensors.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, sin

import numpy as np

from stack.errors import FrameError
from stack.types import FloatArray, Pose2D

Moving = Callable[[float], FloatArray]
"""Returns the transform parent <- child at a stamp in seconds; FrameError if it is not known."""


class FrameTree:
    """Frames with one parent each."""

    def __init__(self) -> None:
        self._above: dict[str, tuple[str, Moving]] = {}

    def fix(self, parent: str, child: str, transform: FloatArray) -> None:
        """Add a frame that does not move in its parent.

        Raises:
            FrameError: it has another parent, or the frames would form a loop.
        """
        self.follow(parent, child, lambda _: transform)

    def follow(self, parent: str, child: str, at: Moving) -> None:
        """Add a frame that moves in its parent: a joint, or what odometry measures.

        Raises:
            FrameError: as `fix`.
        """
        known = self.parent_of(child)
        if known not in (None, parent):
            raise FrameError(f"the frame {child!r} has two parents, {known!r} and {parent!r}")
        if child in self._upwards(parent):
            raise FrameError(f"the frames {parent!r} and {child!r} are above each other")
        self._above[child] = parent, at

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
        found: FloatArray = inverse(self._down(here, stamp)) @ self._down(there, stamp)
        return found

    def _upwards(self, frame: str) -> list[str]:
        """Return a frame and all above it."""
        found = [frame]
        while found[-1] in self._above:
            found.append(self._above[found[-1]][0])
        return found

    def _down(self, chain: list[str], stamp: float) -> FloatArray:
        """Return the transform from the first frame of a chain to its last."""
        found = np.eye(4)
        for child in reversed(chain[:-1]):
            found = found @ self._above[child][1](stamp)
        return found


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


def on_floor(transform: FloatArray) -> Pose2D:
    """Return position and heading of a transform (4, 4), without its height and tilt."""
    heading = atan2(transform[1, 0], transform[0, 0])
    return Pose2D(float(transform[0, 3]), float(transform[1, 3]), heading)
