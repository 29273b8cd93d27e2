"""How the route planner weighs lanes against each other and against free space."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class RouteParameters:
    """Settings of `Route`."""

    graph: str = parameter("", help="GeoJSON file with the lanes; relative to the mission")
    connect: str = parameter(
        "", help="planner of the ways on to the graph and off it; left out: astar, for cars "
        "hybrid_astar",
    )  # fmt: skip
    cost: str = parameter(
        "time", one_of=("time", "distance"),
        help="what a lane costs, times its weight; off the lanes the robot's top speed counts",
    )  # fmt: skip
    off_route: float = parameter(
        5.0, at_least=1.0, at_most=1000.0,
        help="how many times the cost of a lane a way through free space counts",
    )  # fmt: skip
    detour: float = parameter(
        3.0, "m", at_least=0.0,
        help="a way round what stands on a lane may be this much longer than the lane; 0 keeps "
        "to the lanes",
    )  # fmt: skip
    corner_radius: float = parameter(
        0.4, "m", at_least=0.0, help="corners are rounded, at least to the robot's turning radius"
    )
    places: int = parameter(
        6, at_least=1, at_most=100, help="edges and nodes tried as the place to get on or off"
    )
