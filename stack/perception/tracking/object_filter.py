"""Kalman filter of one moving object with a constant velocity."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import hypot

import numpy as np

from stack.perception.tracking.clusters import Disc
from stack.perception.tracking.view import View
from stack.types import FloatArray, StandingObject, TrackedObject

SAME_SIZE = 0.15
"""Metres by which the radius of a disc may differ from the object's; two that touch are larger."""

RADIUS_SHARE = 0.2
"""Gain of the radius's exponential mean."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """A scan that showed an object, and the object's beams in it: (first, last + 1)."""

    view: View
    run: tuple[int, int]


@dataclass
class ObjectFilter:
    """State (4,) x, y, velocity x, y, map frame, with its covariance (4, 4).

    Attributes:
        radius: metres.
        began: first position.
        seen_at: seconds, when a scan showed it last.
        seen: the newest scans that showed it.
        hits: number of scans that showed it.
        has_moved: whether it is known to move; False while it could be a wall.
        absent: scans in a row that have seen through its place.
        whole_at: seconds, when a scan determined its circle last.
    """

    id: int
    state: FloatArray
    covariance: FloatArray
    radius: float
    began: tuple[float, float]
    seen_at: float
    seen: deque[Sighting]
    hits: int = 1
    has_moved: bool = False
    absent: int = 0
    whole_at: float = 0.0

    @property
    def speed(self) -> float:
        """m/s."""
        return hypot(self.state[2], self.state[3])

    def is_seen_through(self, view: View) -> bool:
        """Whether all beams of a scan across the middle of its place pass."""
        return view.share_passed(view.across(self.state[:2], 0.6 * self.radius)) >= 1.0

    def is_like(self, disc: Disc) -> bool:
        """Whether a disc is a circle of this size."""
        return disc.is_circle and abs(disc.radius - self.radius) <= SAME_SIZE

    def away(self, disc: Disc) -> float:
        """Distance of a disc's centre from the state, metres."""
        return hypot(disc.x - self.state[0], disc.y - self.state[1])

    def predict(self, seconds: float, acceleration: float) -> None:
        """x' = F x, P' = F P F^T + Q; Q of a random acceleration that is constant over the step."""
        forward = np.eye(4)
        forward[0, 2] = forward[1, 3] = seconds
        push = np.array([[0.5 * seconds**2, 0.0], [0.0, 0.5 * seconds**2],
                         [seconds, 0.0], [0.0, seconds]])  # fmt: skip
        noise = acceleration**2 * push @ push.T
        self.state = forward @ self.state
        self.covariance = forward @ self.covariance @ forward.T + noise

    def forget_velocity(self) -> None:
        """Allow any velocity up to a reversal, after a manoeuvre within one scan."""
        speed = max(1.0, float(np.hypot(*self.state[2:])))
        change = np.array([0.1, 2.0 * speed])
        self.covariance += np.kron(np.outer(change, change), np.eye(2)) * np.kron(
            np.array([[1.0, 0.5], [0.5, 1.0]]), np.ones((2, 2))
        )

    def correct(self, position: FloatArray, noise: FloatArray) -> None:
        """K = P H^T S^-1; x' = x + K (z - H x); P' = (I - K H) P, for z (2,) with noise (2, 2)."""
        covariance = self.covariance
        xx, xy = covariance[0, 0] + noise[0, 0], covariance[0, 1] + noise[0, 1]
        yy = covariance[1, 1] + noise[1, 1]
        inverse = np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy)
        gain = covariance[:, :2] @ inverse
        self.state = self.state + gain @ (position - self.state[:2])
        corrected = covariance - gain @ covariance[:2, :]
        self.covariance = 0.5 * (corrected + corrected.T)

    def correct_radius(self, radius: float) -> None:
        """Average the radius with that of a whole disc."""
        self.radius += RADIUS_SHARE * (radius - self.radius)

    def track(self, time: float) -> TrackedObject:
        """Return the object as others see it."""
        x, y, speed_x, speed_y = map(float, self.state)
        return TrackedObject(
            self.id, time, (x, y), (speed_x, speed_y), self.radius, self.covariance.copy()
        )

    def standing(self, time: float, since: float) -> StandingObject:
        """Return what has not moved as others see it.

        Args:
            time: seconds.
            since: when it was known to stand there first, seconds.
        """
        x, y = map(float, self.state[:2])
        return StandingObject(
            self.id, time, (x, y), (0.0, 0.0), self.radius, self.covariance.copy(), since=since
        )
