"""What the robot knows of its surroundings, for behaviours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from stack.types import CoveragePlan, Frontier, Marker, OccupancyGrid, Pose2D


class Map(Protocol):
    """What is known of the surroundings, and the costmaps for planning."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map so far: the estimator's, else the mission's, else what the costmap has sensed."""

    @property
    def known_area(self) -> float:
        """Area of the map's free and occupied cells, square metres."""

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The known markers of the map, map frame."""

    def frontiers(
        self, *, sensor_range: float = 6.0, least_size: float = 0.4, least_gain: float = 0.25,
        avoided: Sequence[Pose2D] = (), seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        """Places where the robot can see unknown space, the nearest first; takes milliseconds.

        Args:
            sensor_range: distance at which a view shows unknown space, metres.
            least_size: shorter frontiers are ignored, metres.
            least_gain: views that show less are ignored, square metres.
            avoided: views that are not returned again, for example because no way leads there.
            seen_from: places where the robot has looked around; what the map does not show to be
                in view of them counts as unknown. None: only what the map does not know.
        """

    def coverage(
        self, corners: list[Pose2D], spacing: float, *, clearance: float | None = None
    ) -> CoveragePlan:
        """Lanes that cover an area; takes milliseconds.

        Args:
            corners: of a polygon, map frame; empty: the room in which the robot is.
            spacing: distance of two lanes, metres.
            clearance: of the robot's centre from obstacles, metres; None: the robot's own.
        """

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Clear sensed obstacles from the costmaps. The static map is kept.

        Args:
            which: `local`, `global` or `both`.
            radius: clear only within this distance of the robot, metres; None: everywhere.
            layer: clear only this layer; None: all layers.

        Raises:
            ParameterError: unknown costmap or layer.
        """

    def save(self, name: str) -> str:
        """Save the map as a folder, with its keyframes and pose graph if any; return its name.

        Args:
            name: a path relative to the run folder, or an absolute one.

        Raises:
            NavigationError: FAILED if it cannot be written or its markers cannot be computed.
        """

    def load(self, name: str, pose: Pose2D | None = None) -> None:
        """Load a saved map and use it from now on.

        Args:
            name: a folder or map.yaml; relative to the run folder or else to the mission's folder.
            pose: of the robot in that map; None: unknown.

        Raises:
            NavigationError: FAILED if the files are wrong, UNSUPPORTED if the estimator cannot
                change its map.
        """

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to change the map; the robot localises itself on it in either case.

        Raises:
            NavigationError: the estimator draws no map.
        """
