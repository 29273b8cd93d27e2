"""Parameters of the route planner."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class RouteParameters:
    """Parameters of `Route`."""

    graph: str = parameter(
        "", public=True, help="GeoJSON file with the route graph; relative to the mission"
    )
    connect: str = parameter(
        "", public=True,
        help="planner between start, graph and goal; default: astar, for cars hybrid_astar",
    )  # fmt: skip
    cost: str = parameter(
        "time", one_of=("time", "distance"), public=True,
        help="cost of a lane, times its weight; off the lanes time is at the robot's top speed",
    )  # fmt: skip
    off_route: float = parameter(
        5.0, at_least=1.0, at_most=1000.0,
        help="cost factor of paths through free space compared with lanes",
    )  # fmt: skip
    detour: float = parameter(
        3.0, "m", at_least=0.0, public=True,
        help="largest extra length of a path around an obstacle on a lane; 0: never leave a lane",
    )  # fmt: skip
    corner_radius: float = parameter(
        0.4, "m", at_least=0.0, help="radius of rounded corners; at least the turning radius"
    )
    places: int = parameter(
        6, at_least=1, at_most=100,
        help="number of edges and of nodes tried as the entry to and exit from the graph",
    )  # fmt: skip
