"""Draw the picture of docs/routes.md: the depot's lanes, and ways that were planned on them.

python -m tests.benchmarks.route_picture docs/pictures/routes.png
"""

import argparse

import cv2
import numpy as np

from missions.execution.resources import MISSIONS, load_robot, load_world
from stack.costmap.choosing import usual_layers
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.planner import Route
from stack.sim.worlds.rasterise import rasterise

SCALE = 3
LANE, CLOSED, SLOW = (200, 160, 60), (60, 60, 220), (0, 130, 255)
WAYS = [("dock", "loading", (40, 140, 40)), ("loading", "dock", (180, 40, 150)),
        ("shelf_b", "cold_store", (110, 110, 0))]  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture")
    options = parser.parse_args()
    world, robot = load_world("depot", MISSIONS), load_robot("scout", MISSIONS)
    layers = usual_layers()
    costs = Costmap(CostmapParameters(), robot.footprint, rasterise(world), layers=layers).grid
    file = MISSIONS / "routes" / "depot.geojson"
    route = Route(RouteParameters(graph=str(file)), robot).with_edge("south_west", closed=True)
    cv2.imwrite(options.picture, drawn(costs, route, world.places)[::-1])


def drawn(costs, route, places):
    """(rows, columns, 3) the costmap with lanes and ways, row 0 at the smallest y."""
    shades = np.full(costs.cells.shape, 255, np.uint8)
    shades[costs.cells > 0], shades[costs.cells >= 253], shades[costs.cells == 254] = 238, 200, 70
    picture = cv2.cvtColor(
        cv2.resize(shades, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_NEAREST),
        cv2.COLOR_GRAY2BGR,
    )

    def line(points, colour, width):
        pixels = (points[:, :2] - costs.origin) / costs.resolution * SCALE
        cv2.polylines(picture, [pixels.astype(np.int32)], False, colour, width, cv2.LINE_AA)

    for edge in route.graph.edges.values():
        line(edge.line.points, CLOSED if edge.closed else LANE, 1)
        if edge.one_way:
            ends = edge.line.at(np.array([0.46, 0.54]) * edge.line.length)
            tail, tip = ((ends - costs.origin) / costs.resolution * SCALE).astype(int)
            cv2.arrowedLine(picture, tail.tolist(), tip.tolist(), LANE, 2, cv2.LINE_AA, 0, 0.8)
    for number, (start, goal, colour) in enumerate(WAYS):
        path = route.plan(costs, places[start], places[goal])
        shift = 0.06 * (number - 1)
        line(path.points[:, :2] + shift, colour, 2)
        if path.speed_limits is not None:
            slow = path.points[np.isfinite(path.speed_limits), :2] + shift
            for point in slow[::6]:
                line(np.array([point, point]), SLOW, 4)
    return picture


if __name__ == "__main__":
    main()
