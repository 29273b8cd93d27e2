"""Pictures of an episode from above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.execution.run import Run
from missions.map_picture import Colour, MapPicture
from stack.telemetry.records import Layer
from stack.types import OccupancyGrid, Pose2D

ROBOT: Colour = (255, 200, 120)
PATH: Colour = (180, 120, 60)
SEEN: Colour = (80, 80, 230)
GOAL: Colour = (120, 220, 120)
PERSON: Colour = (230, 120, 230)
"""Colours: blue, green, red."""


class TopView:
    """Draws robot, path, goal, obstacle points and people onto the map of a run."""

    def __init__(self) -> None:
        self._drawn: tuple[Layer, MapPicture] | None = None

    def draw(self, run: Run) -> NDArray[np.uint8]:
        """Return the picture now, (rows, columns, 3) uint8 RGB."""
        runtime = run.engine.runtime
        picture = self._map_of(runtime.parts.perceiver.map_layer).copy()
        perceived, navigator = runtime.perceived, runtime.parts.navigator
        pose: Pose2D = perceived.estimate.pose
        if navigator.path is not None:
            picture.line(navigator.path.points[:, :2], PATH)
        if navigator.goal is not None:
            picture.place("", navigator.goal, GOAL)
        for x, y in pose.transform(perceived.obstacles.points).tolist():
            picture.dot(x, y, SEEN)
        if run.engine.simulation is not None:
            for x, y, radius in run.engine.simulation.people.tolist():
                picture.circle(x, y, radius, PERSON)
        outline = pose.transform(run.engine.body.description.footprint.points)
        picture.line(np.vstack([outline, outline[:1]]), ROBOT)
        front = pose.transform(np.array([[run.engine.body.description.footprint.front, 0.0]]))
        picture.line([(pose.x, pose.y), *front], ROBOT)
        return picture.rgb

    def _map_of(self, layer: Layer) -> MapPicture:
        """Return the picture of the map, which is drawn again when the robot has changed it."""
        if self._drawn is None or self._drawn[0] is not layer:
            assert isinstance(layer.content, OccupancyGrid)
            picture = MapPicture(layer.content)
            picture.begin()
            self._drawn = layer, picture
        return self._drawn[1]
