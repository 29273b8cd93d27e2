"""The map while the robot drives: what is known, where to explore, saving and loading."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stack.components import Estimator
from stack.costmap.layer import Frame, sampled
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, NavigationError, ParameterError
from stack.mapping.exploration.coverage import coverage_plan
from stack.mapping.exploration.frontiers import FrontierParameters, frontiers_of, known_area
from stack.mapping.exploration.views import only_in_view
from stack.mapping.marker_maps import MARKERS_YAML, marker_map_text
from stack.mapping.ros_map import read_ros_map
from stack.mapping.saved_maps import MAP_YAML, folder_contents
from stack.navigation.tasks import CostmapLike
from stack.perception.markers.survey import MarkerSurvey
from stack.perception.places.memory import PlaceMemory
from stack.types import (
    FREE,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    CoveragePlan,
    FailureCode,
    FloatArray,
    Frontier,
    Marker,
    OccupancyGrid,
    Pose2D,
)

SPARE = 0.03
"""Metres that the robot's centre stays farther from obstacles than its inscribed radius."""


class MapStore(Protocol):
    """Where maps are saved."""

    def save(self, name: str, files: dict[str, bytes]) -> str:
        """Write the folder of a map whole or not at all; return where it is.

        Raises:
            OSError: it cannot be written.
        """
        ...

    def find(self, name: str) -> FilePath:
        """Return the path of a saved map, which may not exist."""
        ...


class MapService:
    """Answers questions about the map; keeps only what it has computed from the newest one.

    Args:
        robot: description of the robot.
        estimator: its map is used if it has one.
        costmap: the global costmap: the map of a mission that has none.
        static: the mission's map; None without one.
        store: of saved maps.
        survey: of markers; None without a camera.
        markers: the known ones, which are saved with the surveyed ones.
        places: keyframes that are saved with the map.

    Attributes:
        surveyed: markers that the survey had found when the map was saved last, map frame.
    """

    def __init__(  # noqa: PLR0913 - what it needs of the stack
        self, robot: RobotDescription, estimator: Estimator, costmap: CostmapLike,
        static: OccupancyGrid | None, store: MapStore, survey: MarkerSurvey | None = None,
        markers: Sequence[Marker] = (), places: PlaceMemory | None = None,
    ) -> None:  # fmt: skip
        self._survey, self._markers = survey, tuple(markers)
        self.surveyed: tuple[Marker, ...] = ()
        self._robot, self._estimator, self._costmap = robot, estimator, costmap
        self._static, self._store, self._places = static, store, places
        self._sensed: tuple[int, OccupancyGrid] | None = None
        self._area: tuple[OccupancyGrid, float] | None = None

    @property
    def grid(self) -> OccupancyGrid:
        """The map so far: the estimator's, else the mission's, else what the costmap has sensed."""
        drawn = self._estimator.grid
        if drawn is not None:
            return drawn
        if self._static is not None:
            return self._static
        version = self._costmap.version
        if self._sensed is None or self._sensed[0] != version:
            self._sensed = version, _from_costs(self._costmap)
        return self._sensed[1]

    @property
    def known_area(self) -> float:
        """Area of free and occupied cells, square metres."""
        grid = self.grid
        if self._area is None or self._area[0] is not grid:
            self._area = grid, known_area(grid)
        return self._area[1]

    def frontiers(
        self, pose: Pose2D, parameters: FrontierParameters, avoided: Sequence[Pose2D] = (),
        seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        """Return the frontiers that the robot can reach, the nearest first, with other views.

        With `seen_from`, all that is out of view from these places counts as unknown.
        """
        radius = self._robot.footprint.inscribed_radius + SPARE
        grid = self.grid
        if seen_from is not None:
            grid = only_in_view(grid, seen_from, parameters.sensor_range)
        return frontiers_of(grid, pose, radius, parameters, avoided)

    def coverage(
        self, pose: Pose2D, corners: FloatArray | None, spacing: float, clearance: float | None
    ) -> CoveragePlan:
        """Return lanes that cover a polygon, or the robot's room, except keep-out zones."""
        radius = self._robot.footprint.half_width + SPARE
        zones = self._zones()
        return coverage_plan(self.grid, pose, clearance or radius, spacing, corners, zones)

    def _zones(self) -> dict[str, NDArray[np.bool_]]:
        """Return the cells (rows, columns) of the map in each keep-out zone, by name."""
        grid, view = self.grid, self._costmap.view
        frame = Frame(grid.cells.shape, grid.resolution, grid.origin)
        found = {}
        for name, cells in self._costmap.forbidden.items():
            zone = OccupancyGrid(cells.astype(np.int8), view.resolution, view.origin)
            found[name] = sampled(zone, frame, frame.everywhere, 0) > 0
        return found

    def save(self, name: str) -> str:
        """Save the map, its keyframes and what the estimator adds, for example its pose graph.

        Raises:
            NavigationError: FAILED if it cannot be written or its markers cannot be computed.
        """
        keyframes = {} if self._places is None else self._places.files()
        try:
            own = {**self._estimator.map_files(), **self._marker_map(), **keyframes}
        except InputError as error:
            sentence = f"the map cannot be saved to {name!r}: {error}"
            raise NavigationError(FailureCode.FAILED, sentence) from None
        files = folder_contents(self.grid, own)
        try:
            return self._store.save(name, files)
        except OSError as error:
            sentence = f"the map cannot be saved to {name!r}: {error.strerror or error}"
            raise NavigationError(FailureCode.FAILED, sentence) from None

    def _marker_map(self) -> dict[str, bytes]:
        """Return the map of markers of a saved map, if the mission surveys them."""
        if self._survey is None or not self._survey.parameters.survey:
            return {}
        exact = {_key(one) for one in self._markers if not one.position_deviation}
        mapped = [one for one in self._estimator.mapped_markers() if _key(one) not in exact]
        self.surveyed = self._survey.markers(self._estimator.corrected_pose, mapped)
        again = {_key(one) for one in self.surveyed}
        known = [one for one in self._markers if _key(one) not in again]
        text = marker_map_text((*known, *self.surveyed), "saved with the map")
        return {MARKERS_YAML: text.encode()}

    def load(self, name: str, pose: Pose2D | None) -> OccupancyGrid:
        """Load a saved map into the estimator, and its keyframes, and use it from now on.

        Args:
            name: of the folder, or of a map.yaml.
            pose: of the robot in that map; None: unknown.

        Raises:
            NavigationError: FAILED if the files are wrong, UNSUPPORTED if the estimator cannot
                change its map.
        """
        path = self._store.find(name)
        folder = path if path.is_dir() else path.parent
        try:
            grid = read_ros_map(path / MAP_YAML if path.is_dir() else path)
            self._estimator.load_map(grid, folder, pose)
            if self._places is not None:
                self._places.load(folder)
        except (InputError, ParameterError) as error:
            raise NavigationError(FailureCode.FAILED, f"cannot load {name!r}: {error}") from None
        self._static = grid
        return grid


def _key(marker: Marker) -> tuple[str, int]:
    return marker.dictionary, marker.number


def _from_costs(costmap: CostmapLike) -> OccupancyGrid:
    """Return the obstacles and free cells that a costmap without a map has sensed."""
    view = costmap.marks
    cells = np.full(view.cells.shape, FREE, np.int8)
    cells[view.cells == LETHAL_COST] = OCCUPIED
    cells[view.cells == UNKNOWN_COST] = UNKNOWN
    return OccupancyGrid(cells, view.resolution, view.origin)
