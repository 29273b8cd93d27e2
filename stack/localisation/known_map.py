"""A known map as localisation needs it: distances, comparison with scans, search, usual fits."""

from __future__ import annotations

import numpy as np

from stack.localisation.distance_field import surface_field
from stack.localisation.health import FitScale, ScanEvaluator, calibrate
from stack.localisation.health_model import HealthFeatures, health
from stack.localisation.search.map_search import MapSearch
from stack.types import OccupancyGrid, Pose2D, Scan

UNTESTED_HEALTH = 0.8
"""Health of a pose that was set and that no scan has tested."""


class KnownMap:
    """One map, and how well scans usually fit it.

    Args:
        grid: the map.
        noise: standard deviation of a range of the lidar, metres.
        obstacles: up to so many unmapped ones around the robot are normal.
        generator: of the simulated scans that tell how well scans fit.

    Attributes:
        field: distances to the surfaces.
        noise: of the lidar.
        evaluator: compares scans with the map.
        search: finds poses that explain scans.
        scale: fits at true poses; None before the first scan, which shows the lidar.
    """

    def __init__(
        self, grid: OccupancyGrid, noise: float, obstacles: int, generator: np.random.Generator
    ) -> None:
        self.field = surface_field(grid)
        self.noise = noise
        self.evaluator = ScanEvaluator(self.field, noise)
        self.search = MapSearch(self.field, self.evaluator, noise)
        self.scale: FitScale | None = None
        self._obstacles, self._generator = obstacles, generator

    def expect(self, obstacles: int) -> None:
        """Change the number of unmapped obstacles that are normal."""
        if obstacles != self._obstacles:
            self._obstacles, self.scale = obstacles, None

    def scale_for(self, scan: Scan) -> FitScale:
        """Return the fits at true poses, measured with the beams of the first scan."""
        if self.scale is None:
            self.scale = calibrate(
                self.evaluator, self.field, scan, self.noise, self._obstacles, self._generator
            )
        return self.scale

    def fit_at(self, pose: Pose2D, scan: Scan, deviation: float) -> float:
        """Return the health in [0, 1] of a single scan at a pose with this deviation, metres."""
        view = self.evaluator.view(pose, scan)
        return health(HealthFeatures(view, view, self.scale_for(scan), deviation, 1.0))
