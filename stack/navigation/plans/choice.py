"""Which plans a drive takes: the goal's tolerance, better paths, and routes found blocked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from stack.costmap.route_costs import route_cost
from stack.geometry.path_progress import PathProgress
from stack.navigation.drive_tools import DriveTools
from stack.navigation.plans.planner_worker import Plan
from stack.planning.endpoints import xy_text
from stack.types import Failure, FailureCode, FloatArray, Path, Pose2D

REPLAN_GAIN = 0.1
"""Share by which a better path must be cheaper: less, and two paths alternate."""
BLOCKAGE_TIME = 10.0
"""How long a place that was found blocked is avoided; doubles each time it is again, s."""
BLOCKAGE_RADIUS = 0.6
"""Paths this close to a blocked place lead through it, m."""

NEAR_ENOUGH = 0.5
"""Metres before the end of a partial path within which an obstacle is expected. A robot that
stops there has reached the end of the path and does not search for another end.
"""

CLOSER_BY = 0.02
"""Metres by which a path must end closer to the goal to be better whatever it costs."""

LEAST_GAIN = 0.1
"""Cost that a better path saves at least."""


@dataclass(frozen=True, slots=True)
class Blockage:
    """A blocked position (map frame, metres), remembered for `hold` seconds, until time `until`."""

    x: float
    y: float
    hold: float
    until: float


class Blockages:
    """Blockages found during one drive, so that it does not go back and forth between two routes.

    A gap is blocked when seen from near. When the robot has driven away, the obstacle expires from
    the costmap and the path through the gap looks better again. A remembered blockage rejects such
    paths for a while. The time doubles each time the gap is found blocked again.

    Args:
        radius: metres within which two blockages are the same and a path leads through one.
        first_hold: seconds for which a new blockage is remembered.
    """

    def __init__(self, radius: float, first_hold: float) -> None:
        self._radius, self._first_hold = radius, first_hold
        self._known: list[Blockage] = []

    def note(self, place: tuple[float, float], time: float) -> None:
        """Remember that the path is blocked at a position (x, y), map frame, metres."""
        x, y = place
        for i, known in enumerate(self._known):
            if np.hypot(known.x - x, known.y - y) <= self._radius:
                hold = 2.0 * known.hold if time > known.until else known.hold
                self._known[i] = replace(known, hold=hold, until=time + hold)
                return
        self._known.append(Blockage(x, y, self._first_hold, time + self._first_hold))

    def bar(self, points: FloatArray, time: float) -> bool:
        """Whether a path (n, 2) leads through a blockage that is still remembered."""
        return any(
            bool((np.hypot(points[:, 0] - b.x, points[:, 1] - b.y) <= self._radius).any())
            for b in self._known
            if time < b.until
        )


class PlanChoice:
    """Judges the plans of a drive.

    Args:
        tools: of the drive.
        goal: the last goal, map frame.
        tolerance: metres to it; None: that of the goal checker.

    Attributes:
        tolerance: as given.
    """

    def __init__(self, tools: DriveTools, goal: Pose2D, tolerance: float | None) -> None:
        self._tools, self._goal, self.tolerance = tools, goal, tolerance
        self._blockages = Blockages(BLOCKAGE_RADIUS, BLOCKAGE_TIME)

    def note_blocked(self, at: tuple[float, float], now: float) -> None:
        """Remember where a path was blocked, map frame: other paths avoid it for a while."""
        self._blockages.note(at, now)

    def within_tolerance(self, plan: Plan) -> Plan | Failure:
        """Return the plan, or a failure when it ends farther from the goal than the tolerance."""
        distance = plan.path.goal.distance_to(self._goal)
        if self.tolerance is None or distance <= self.tolerance or plan.path.partial:
            return plan
        return Failure(
            FailureCode.GOAL_OCCUPIED,
            f"the nearest reachable pose is {distance:.2f} m away from the goal "
            f"{xy_text(self._goal)}, the tolerance is {self.tolerance:.2f} m",
        )

    def is_clearly_better(
        self, plan: Plan, path: Path | None, progress: PathProgress | None, now: float
    ) -> bool:
        """Whether a plan is so much better that it replaces the current path.

        Args:
            plan: the new one.
            path: the current one; None without one.
            progress: on it.
            now: seconds.
        """
        if progress is None or path is None:
            return True
        if self._blockages.bar(plan.path.points, now):
            return False
        closer = path.goal.distance_to(self._goal) - plan.path.goal.distance_to(self._goal)
        if plan.path.partial and path.partial:
            return closer > NEAR_ENOUGH  # the other side of a table may be nearer by one cell
        if closer > CLOSER_BY:
            return True
        costs = self._tools.global_costmap.view
        old = route_cost(costs, progress.ahead(inf))
        new = route_cost(costs, plan.path.points)
        return new < (1.0 - REPLAN_GAIN) * old - LEAST_GAIN
