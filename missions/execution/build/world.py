"""The world as the robot knows it: the mission's map, costmaps, tracker and speed limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from missions.execution.prepare import MAP_ORIGIN, PreparedMission
from missions.execution.resources import load_map
from stack.costmap.costmap import Costmap
from stack.costmap.speed_limits import SpeedLimits
from stack.costmap.unexplored import GrowingMap, resampled_grid, unexplored
from stack.navigation.landmarks import Doorway, Landmarks
from stack.navigation.world_model import WorldModel
from stack.perception.tracking.tracker import Tracker
from stack.types import OccupancyGrid


def map_of(plan: PreparedMission) -> OccupancyGrid:
    """Return the mission's map; without one, an unknown map around the start."""
    if plan.mission.map == "from_world":
        from stack.sim.worlds.rasterise import rasterise  # imports OpenCV, so only for a run

        return rasterise(replace(plan.world, start=plan.start))
    if plan.mission.map == "none":
        resolution = plan.choices["costmap"].parameters.resolution
        return unexplored([plan.belief or MAP_ORIGIN], resolution)
    return load_map(plan.mission.map, plan.mission.source.parent)


def world_model_of(plan: PreparedMission, grid: OccupancyGrid) -> WorldModel:
    """Return costmaps, tracker and speed limits; without a map, the map grows with the robot."""
    local_costmap, global_costmap = _costmaps(plan, _costmap_grid(plan, grid))
    ground = None if plan.is_mapped else GrowingMap(grid, [global_costmap])
    return WorldModel(
        local_costmap, global_costmap, Tracker(plan.choices["tracker"].parameters, grid),
        SpeedLimits(plan.choices["speed_limits"].parameters), lidar=plan.robot.main_lidar,
        deceleration=plan.robot.limits.linear_deceleration,
        cover=_ignore if ground is None else ground.cover,
        draw=_replacing(local_costmap, global_costmap) if ground is None else ground.draw,
    )  # fmt: skip


def _costmap_grid(plan: PreparedMission, grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map for the costmaps; drawn from the world, it is finer than the localiser's.

    At 5 cm a door at an angle to the grid can lose 7 cm on each side.
    """
    resolution = plan.choices["costmap"].parameters.map_resolution
    if plan.mission.map != "from_world" or resolution == grid.resolution:
        return grid
    from stack.sim.worlds.rasterise import rasterise

    return rasterise(replace(plan.world, start=plan.start), resolution)


def _costmaps(plan: PreparedMission, grid: OccupancyGrid) -> tuple[Costmap, Costmap]:
    """Return the local and the global costmap, each with its layers."""
    choice, footprint = plan.choices["costmap"], plan.robot.footprint
    layers = {
        name: [layer for layer in choice.parts if layer.only in ("both", name)]
        for name in ("local", "global")
    }
    costs = choice.parameters
    static = grid if plan.is_mapped else None
    local = Costmap(costs, footprint, static, window=costs.local_size, layers=layers["local"])
    return local, Costmap(costs, footprint, grid, layers=layers["global"])


def _replacing(*costmaps: Costmap) -> Callable[[OccupancyGrid], None]:
    """Return the function that replaces the known map of costmaps, at their resolution."""

    def draw(grid: OccupancyGrid) -> None:
        for costmap in costmaps:
            costmap.set_static(resampled_grid(grid, costmap.marks.resolution))

    return draw


def _ignore(_: object = ()) -> None:
    """Do nothing: a known map does not grow, and without a tracker there are no tracks."""


def landmarks_of(plan: PreparedMission) -> Landmarks:
    """Return the names of the mission's places, and of the doors of a map made from its world."""
    doors = plan.world.doors if plan.mission.map == "from_world" else ()
    doorways = [Doorway(door.name, door.start, door.end) for door in doors]
    return Landmarks(plan.mission.places, doorways)
