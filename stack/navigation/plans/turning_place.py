"""Where a robot turns to its goal's heading if there is no room to turn at the goal itself."""

from __future__ import annotations

import numpy as np

from stack.navigation.escape.unseen import cells_around
from stack.navigation.people.backing_out import TURNING_ROOM, can_turn
from stack.types import INSCRIBED_COST, CostGrid, FloatArray, Footprint, Pose2D

TURNING_DISTANCE = 0.25
"""Metres from the goal at which it may turn, if the task sets no tolerance."""

STOPS_WITHIN = 0.05
"""Metres from the end of its path at which a robot may stop: room that is better left."""


def turning_place(  # noqa: PLR0913 - of one robot at one goal
    goal: Pose2D, pose: Pose2D, costs: CostGrid, points: FloatArray, outline: Footprint,
    reach: float,
) -> Pose2D | None:  # fmt: skip
    """Return where the robot can turn: here, or at the nearest cell to the goal; None if nowhere.

    Args:
        goal: map frame.
        pose: of the robot, near the goal.
        costs: costmap, map frame.
        points: (n, 2) of obstacles, base frame, metres.
        outline: of the robot.
        reach: metres from the goal within which a place is searched.

    Returns:
        A pose with the goal's heading, map frame, within the reach.
    """
    need = outline.circumscribed_radius + TURNING_ROOM
    if can_turn(points, outline) and pose.distance_to(goal) <= reach:
        return Pose2D(pose.x, pose.y, goal.heading)
    points = pose.transform(points)
    near, first = cells_around(costs, costs.cells, goal, reach)
    rows, columns = np.nonzero(near < INSCRIBED_COST)
    corner = np.array(costs.centre_of(*first))
    places = corner + costs.resolution * np.column_stack((columns, rows))
    away = np.hypot(*(places - (goal.x, goal.y)).T)
    beside = np.hypot(*(points - (goal.x, goal.y)).T) <= reach + need + STOPS_WITHIN
    gaps = places[:, None] - points[None, beside]
    room = np.hypot(gaps[..., 0], gaps[..., 1]).min(axis=1, initial=np.inf)
    for more in (STOPS_WITHIN, 0.0):
        fits = np.flatnonzero((away <= reach) & (room > need + more))
        if len(fits):
            x, y = places[fits[np.argmin(away[fits])]].tolist()
            return Pose2D(x, y, goal.heading)
    return None
