"""The last second of the odometry filter: delayed measurements get their place in time.

The history is a list of nodes in the order of their stamps: parts of motions and measurements, each
with the state after it. A delayed measurement is inserted at its stamp, and the nodes after it are
computed again, so the state is the one that ordered measurements give, to the last bit.
"""

from __future__ import annotations

from bisect import insort
from dataclasses import dataclass, field
from itertools import islice
from math import inf
from typing import Protocol

import numpy as np

from stack.localisation.fusion import kernels
from stack.types import NO_COVARIANCE, FloatArray, Pose2D

TOLERANCE = 1e-9
"""Stamps closer than this are equal, seconds: the one that came first stands for both."""


class Measurement(Protocol):
    """Something that changes the state at a stamp."""

    @property
    def stamp(self) -> float:
        """When it was measured, seconds."""
        ...

    @property
    def name(self) -> str:
        """Its source; orders measurements with the same stamp."""
        ...

    def apply(self, state: FloatArray, covariance: FloatArray) -> float:
        """Update the state in place; return the Mahalanobis distance, or 0."""
        ...


@dataclass(slots=True)
class Motion:
    """Part of a motion of the base.

    Attributes:
        given: (9,) input of the kernel `predict`.
        begin: of the part, seconds.
        end: of the part, seconds.
        disturbed: whether the wheels do not show how the base moved.
    """

    given: FloatArray
    begin: float
    end: float
    disturbed: bool


@dataclass(slots=True)
class Node:
    """A motion or measurement, and the state after it.

    Attributes:
        key: stamp, rank (motions first), name.
        event: what happened.
        state: (11,).
        covariance: (11, 11).
        step_covariance: (3, 3) of a motion's displacement, base frame at its end.
        distance: Mahalanobis distance of a measurement.
    """

    key: tuple[float, int, str]
    event: Motion | Measurement | None
    state: FloatArray
    covariance: FloatArray
    step_covariance: FloatArray = field(default_factory=lambda: NO_COVARIANCE)
    distance: float = 0.0

    @property
    def pose(self) -> Pose2D:
        """Of the base, odom frame."""
        return Pose2D(*self.state[:3].tolist())


class History:
    """States of the filter over the last `span` seconds.

    Args:
        stamp: of the first state, seconds.
        state: (11,).
        covariance: (11, 11).
        noise: (11,) of the kernel `predict`.
        span: seconds.
    """

    def __init__(
        self, stamp: float, state: FloatArray, covariance: FloatArray, noise: FloatArray,
        span: float,
    ) -> None:  # fmt: skip
        self._noise, self._span = noise, span
        self.nodes = [Node((stamp, 0, ""), None, state, covariance)]
        self._early: list[tuple[float, str, Measurement]] = []

    def configure(self, span: float) -> None:
        """Use another span, seconds, from now on."""
        self._span = span

    @property
    def newest(self) -> Node:
        """The node with the current state."""
        return self.nodes[-1]

    @property
    def oldest_stamp(self) -> float:
        """Older measurements cannot be used, seconds."""
        return self.nodes[0].key[0]

    def move(self, given: FloatArray, disturbed: bool) -> None:
        """Append a motion, an input (9,) of `predict`; it begins at the newest stamp."""
        begin = self.newest.key[0]
        end = begin + float(given[kernels.DURATION])
        motion = Motion(given, begin, end, disturbed)
        self.nodes.append(_blank((end, 0, ""), motion))
        self._run(len(self.nodes) - 1)
        while self._early and self._early[0][0] <= end + TOLERANCE:
            self.add(self._early.pop(0)[2])
        while len(self.nodes) > 2 and self.nodes[1].key[0] < end - self._span:
            del self.nodes[0]

    def add(self, measurement: Measurement) -> Node | None:
        """Add a measurement at its stamp; return its node, None if it is too old or too early.

        One that is too early is added once the motions reach its stamp.
        """
        if measurement.stamp > self.newest.key[0] + TOLERANCE:
            insort(
                self._early, (measurement.stamp, measurement.name, measurement),
                key=lambda early: early[:2],
            )  # fmt: skip
            return None
        if measurement.stamp < self.oldest_stamp - TOLERANCE:
            return None
        place = self._split(measurement.stamp)
        stamp = self.nodes[place].key[0]
        node = _blank((stamp, 1, measurement.name), measurement)
        place += 1
        while place < len(self.nodes) and self.nodes[place].key <= node.key:
            place += 1
        self.nodes.insert(place, node)
        self._run(place)
        return node

    def replace(self, node: Node, measurement: Measurement) -> None:
        """Replace a measurement by another one of the same stamp."""
        self.nodes.remove(node)
        self.add(measurement)

    def at(self, stamp: float) -> Node | None:
        """Return the last node at a stamp, dividing a motion there; None outside the history."""
        if not self.oldest_stamp - TOLERANCE <= stamp <= self.newest.key[0] + TOLERANCE:
            return None
        place = self._split(stamp)
        while place + 1 < len(self.nodes) and self.nodes[place + 1].key[0] <= stamp + TOLERANCE:
            place += 1
        return self.nodes[place]

    def motion_error(self, since: float, until: float = inf) -> FloatArray:
        """Return the (3, 3) error of the motions between two stamps, base frame."""
        total = np.zeros((3, 3))
        for node in reversed(self.nodes):
            if node.key[0] <= since + TOLERANCE:
                break
            if node.key[0] <= until + TOLERANCE:
                total += node.step_covariance
        return total

    def disturb(self, since: float) -> None:
        """Do not use the wheels from a stamp on (or from the oldest one)."""
        place = self._split(max(since, self.oldest_stamp))
        changed = False
        for node in self.nodes[place + 1 :]:
            if isinstance(node.event, Motion) and not node.event.disturbed:
                node.event.disturbed = changed = True
        if changed:
            self._run(place + 1)

    def _split(self, stamp: float) -> int:
        """Divide the motion around a stamp; return the number of the motion that ends there."""
        place = len(self.nodes) - 1
        while place > 0 and (
            self.nodes[place].key[1] > 0 or self.nodes[place].key[0] > stamp + TOLERANCE
        ):
            place -= 1
        if stamp <= self.nodes[place].key[0] + TOLERANCE or place + 1 == len(self.nodes):
            return place
        place += 1
        while not isinstance(self.nodes[place].event, Motion):
            place += 1
        motion = self.nodes[place].event
        assert isinstance(motion, Motion)
        first = Motion(motion.given, motion.begin, stamp, motion.disturbed)
        motion.begin = stamp
        self.nodes.insert(place, _blank((stamp, 0, ""), first))
        self._run(place)
        return place

    def _run(self, place: int) -> None:
        """Compute the states from a node on."""
        before = self.nodes[place - 1]
        disturbed = self._was_disturbed(place)
        for node in islice(self.nodes, place, None):
            event, state, covariance = node.event, node.state, node.covariance
            state[:], covariance[:] = before.state, before.covariance
            if isinstance(event, Motion):
                mode = kernels.TRUSTED
                if event.disturbed:
                    mode = kernels.DISTURBED if disturbed else kernels.ENTERING
                disturbed = event.disturbed
                share = (event.end - event.begin) / float(event.given[kernels.DURATION])
                node.step_covariance = kernels.predict(
                    state, covariance, event.given, share, mode, self._noise
                )
            elif event is not None:
                node.distance = event.apply(state, covariance)
            before = node

    def _was_disturbed(self, place: int) -> bool:
        for earlier in range(place - 1, -1, -1):
            event = self.nodes[earlier].event
            if isinstance(event, Motion):
                return event.disturbed
        return False


def _blank(key: tuple[float, int, str], event: Motion | Measurement) -> Node:
    size = kernels.SIZE
    return Node(key, event, np.empty(size), np.empty((size, size)))
