"""The map of a robot that the stack drives: known space, where to explore, saving, clearing."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from pathlib import Path as FilePath
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stack.components import Estimator
from stack.costmap.costmap import Costmap
from stack.costmap.layer import Frame, sampled
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, NavigationError, ParameterError, WorkerError
from stack.mapping.exploration.coverage import coverage_plan
from stack.mapping.exploration.frontiers import FrontierParameters, frontiers_of, known_area
from stack.mapping.exploration.views import only_in_view
from stack.mapping.marker_maps import MARKERS_YAML, marker_map_text
from stack.mapping.ros_map import read_ros_map
from stack.mapping.saved_maps import MAP_YAML, folder_contents
from stack.navigation.relocalisation import report_pose
from stack.navigation.tasks import Emit
from stack.navigation.world_model import WorldModel
from stack.parameters import suggestion
from stack.perception.markers.survey import MarkerSurvey
from stack.perception.places.memory import PlaceMemory
from stack.robot import Map
from stack.types import (
    FREE,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    CoveragePlan,
    FailureCode,
    Frontier,
    Marker,
    OccupancyGrid,
    Pose2D,
)

SPARE_CLEARANCE = 0.03
"""Metres that the robot's centre stays farther from obstacles than its inscribed radius."""


class MapStore(Protocol):
    """Where maps are saved."""

    def save(self, name: str, files: dict[str, bytes]) -> str:
        """Write the folder of a map whole or not at all; return where it is.

        Raises:
            OSError: it cannot be written.
        """

    def find(self, name: str) -> FilePath:
        """Return the path of a saved map, which may not exist."""


class StackMap(Map):
    """Answers from estimator and costmaps; keeps only what it has computed from the newest map.

    Args:
        robot: description of the robot.
        estimator: its map is used if it has one.
        world: with the costmaps, the map of a mission that has none.
        static: the mission's map; None without one.
        store: of saved maps.
        emit: called with (kind, text, level="info", **fields) for each event.
        survey: of markers; None without a camera.
        markers: the known ones, which are saved with the surveyed ones.
        places: keyframes that are saved with the map.
    """

    def __init__(  # noqa: PLR0913 - what it needs of the stack
        self, robot: RobotDescription, estimator: Estimator, world: WorldModel,
        static: OccupancyGrid | None, store: MapStore, emit: Emit,
        survey: MarkerSurvey | None = None, markers: Sequence[Marker] = (),
        places: PlaceMemory | None = None,
    ) -> None:  # fmt: skip
        self._survey, self._markers = survey, tuple(markers)
        self._robot, self._estimator, self._world = robot, estimator, world
        self._static, self._store, self._emit, self._places = static, store, emit, places
        self._sensed: tuple[int, OccupancyGrid] | None = None
        self._area: tuple[OccupancyGrid, float] | None = None

    @property
    def grid(self) -> OccupancyGrid:
        drawn = self._estimator.grid
        if drawn is not None:
            return drawn
        if self._static is not None:
            return self._static
        costmap = self._world.global_costmap
        if self._sensed is None or self._sensed[0] != costmap.version:
            self._sensed = costmap.version, _from_costs(costmap)
        return self._sensed[1]

    @property
    def markers(self) -> tuple[Marker, ...]:
        return self._markers

    @property
    def known_area(self) -> float:
        grid = self.grid
        if self._area is None or self._area[0] is not grid:
            self._area = grid, known_area(grid)
        return self._area[1]

    def frontiers(
        self, *, sensor_range: float = 6.0, least_size: float = 0.4, least_gain: float = 0.25,
        avoided: Sequence[Pose2D] = (), seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        radius = self._robot.footprint.inscribed_radius + SPARE_CLEARANCE
        grid = self.grid
        if seen_from is not None:
            grid = only_in_view(grid, seen_from, sensor_range)
        parameters = FrontierParameters(sensor_range, least_size, least_gain)
        return frontiers_of(grid, self._pose, radius, parameters, avoided)

    def coverage(
        self, corners: Sequence[Pose2D], spacing: float, *, clearance: float | None = None
    ) -> CoveragePlan:
        radius = self._robot.footprint.half_width + SPARE_CLEARANCE
        polygon = np.array([(corner.x, corner.y) for corner in corners]) if corners else None
        return coverage_plan(
            self.grid, self._pose, clearance or radius, spacing, polygon, self._zones()
        )

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        named = {"local": self._world.local_costmap, "global": self._world.global_costmap}
        known = (*named, "both")
        if which not in known:
            raise ParameterError(
                "which", f"{which!r} is not one of {', '.join(known)}", suggestion(which, known)
            )
        costmaps = [item for name, item in named.items() if which in (name, "both")]
        layers = [name for costmap in costmaps for name in costmap.layers]
        if layer is not None and layer not in layers:
            raise ParameterError("layer", f"unknown layer {layer!r}", suggestion(layer, layers))
        for costmap in costmaps:
            if layer is not None and layer not in costmap.layers:
                continue
            if radius is None:
                costmap.clear(layer=layer)
            else:
                costmap.clear_around(self._pose, radius, layer=layer)
        within = "" if radius is None else f", {radius:g} m around the robot"
        only = "" if layer is None else f", layer {layer}"
        self._emit("recovery", f"cleared costmap: {which}{within}{only}", costmap=which)

    def set_mapping(self, is_mapping: bool) -> None:
        self._estimator.set_mapping(is_mapping)
        self._emit("map", "mapping" if is_mapping else "localising on the map as it is")

    @property
    def _pose(self) -> Pose2D:
        return self._estimator.estimate.pose

    def _zones(self) -> dict[str, NDArray[np.bool_]]:
        """Return the cells (rows, columns) of the map in each keep-out zone, by name."""
        grid, costmap = self.grid, self._world.global_costmap
        view = costmap.view
        frame = Frame(grid.cells.shape, grid.resolution, grid.origin)
        found = {}
        for name, cells in costmap.forbidden.items():
            zone = OccupancyGrid(cells.astype(np.int8), view.resolution, view.origin)
            found[name] = sampled(zone, frame, frame.everywhere, 0) > 0
        return found

    def save(self, name: str) -> str:
        if why := self._estimator.unmapped:
            sentence = f"the map cannot be saved to {name!r}: nothing is mapped: {why}"
            raise NavigationError(FailureCode.FAILED, sentence)
        keyframes = {} if self._places is None else self._places.files()
        try:
            surveyed = self._surveyed()
            marker_map = {} if surveyed is None else self._marker_map(surveyed)
            own = {**self._estimator.map_files(), **marker_map, **keyframes}
        except (InputError, WorkerError) as error:
            sentence = f"the map cannot be saved to {name!r}: {error}"
            raise NavigationError(FailureCode.FAILED, sentence) from None
        files = folder_contents(self.grid, own)
        try:
            saved = self._store.save(name, files)
        except OSError as error:
            sentence = f"the map cannot be saved to {name!r}: {error.strerror or error}"
            raise NavigationError(FailureCode.FAILED, sentence) from None
        self._emit("map", f"saved the map as {saved}: {self.known_area:.1f} m² known")
        for one in surveyed or ():
            x, y, _ = one.position
            self._emit(
                "marker",
                f"surveyed marker {one.number} at ({x:.2f}, {y:.2f}), {degrees(one.heading):.0f} "
                f"deg, within {one.position_deviation:.2f} m and "
                f"{degrees(one.heading_deviation):.1f} deg",
                number=one.number, x=round(x, 3), y=round(y, 3), heading=round(one.heading, 4),
            )  # fmt: skip
        return saved

    def _surveyed(self) -> tuple[Marker, ...] | None:
        """Return the markers that the mission has surveyed; None if it does not survey."""
        if self._survey is None or not self._survey.parameters.survey:
            return None
        exact = {_key(one) for one in self.markers if not one.position_deviation}
        mapped = [one for one in self._estimator.mapped_markers() if _key(one) not in exact]
        return self._survey.markers(self._estimator.corrected_pose, mapped)

    def _marker_map(self, surveyed: Sequence[Marker]) -> dict[str, bytes]:
        """Return the map of markers of a saved map."""
        again = {_key(one) for one in surveyed}
        known = [one for one in self.markers if _key(one) not in again]
        text = marker_map_text((*known, *surveyed), "saved with the map")
        return {MARKERS_YAML: text.encode()}

    def load(self, name: str, pose: Pose2D | None = None) -> None:
        path, before = self._store.find(name), self._pose
        folder = path if path.is_dir() else path.parent
        try:
            grid = read_ros_map(path / MAP_YAML if path.is_dir() else path)
            self._estimator.load_map(grid, folder, pose)
            if self._places is not None:
                self._places.load(folder)
        except (InputError, ParameterError) as error:
            raise NavigationError(FailureCode.FAILED, f"cannot load {name!r}: {error}") from None
        self._static = grid
        rows, columns = grid.cells.shape
        x, y = grid.origin
        end = Pose2D(x + columns * grid.resolution, y + rows * grid.resolution)
        self._world.cover([Pose2D(x, y), end])
        self._world.draw(grid)
        report_pose(self._emit, before, self._pose, "map")


def _key(marker: Marker) -> tuple[str, int]:
    return marker.dictionary, marker.number


def _from_costs(costmap: Costmap) -> OccupancyGrid:
    """Return the obstacles and free cells that a costmap without a map has sensed."""
    view = costmap.marks
    cells = np.full(view.cells.shape, FREE, np.int8)
    cells[view.cells == LETHAL_COST] = OCCUPIED
    cells[view.cells == UNKNOWN_COST] = UNKNOWN
    return OccupancyGrid(cells, view.resolution, view.origin)
