"""Builds the running parts of a plan: body, estimator, costmaps, navigation, tree, telemetry."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import sleep  # noqa: TID251 - only while the simulation is held
from typing import Any

from missions.execution.ground_truth import SimulationScorer
from missions.execution.picture_store import PictureStore
from missions.execution.prepare import NOWHERE, PreparedMission, RunOptions
from missions.execution.resources import load_map, versions
from missions.trees.compiler import compile_mission
from missions.trees.debugging import TreeDebugger, addresses
from missions.trees.mission_tree import MissionTree
from robots.simulated import SimulatedBody
from stack.control.cusp_splitter import controller_for
from stack.costmap.costmap import Costmap
from stack.costmap.unexplored import Ground, unexplored
from stack.drivetrain.description import DriveKind
from stack.errors import InputError
from stack.localisation.dead_reckoning import DeadReckoning
from stack.localisation.localiser import Localiser
from stack.localisation.odometry import OdometryFusion
from stack.localisation.parameters import LocaliserParameters
from stack.navigation.navigator import Navigator
from stack.navigation.robot_facade import FacadeParts, RobotFacade
from stack.navigation.tuning import Tunable
from stack.perception.markers import MarkerDetector
from stack.perception.tracker import Tracker
from stack.runtime.interfaces import Parts, Rates
from stack.runtime.loop import Runtime
from stack.safety.safety import Safety
from stack.telemetry.hub import Telemetry
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Layer, RunInfo
from stack.types import OccupancyGrid, Pose2D

IDLE_SECONDS = 0.02
"""Wall seconds between two looks for commands while the robot is held."""

LOCAL_WINDOW = 5.0
"""Side of the rolling local costmap, metres."""


@dataclass
class Engine:
    """A runtime ready to step, and what has to be closed after it.

    Attributes:
        between_steps: called before each step.
    """

    runtime: Runtime
    body: SimulatedBody
    tree: MissionTree
    telemetry: Telemetry
    scorer: SimulationScorer
    debugger: TreeDebugger
    between_steps: Callable[[], None] = lambda: None


def run_info(plan: PreparedMission, run_id: str, seed: int) -> RunInfo:
    """What every sink is told when it opens."""
    return RunInfo(
        run_id=run_id,
        mission=plan.mission.source.stem,
        title=plan.mission.name,
        robot=plan.robot.name,
        world=plan.world.name,
        seed=seed,
        footprint=plan.robot.footprint,
        markers=plan.world.markers,
        urdf=plan.robot.urdf.read_text("utf-8"),
        versions=versions(),
        places=dict(plan.mission.places),
    )


def build(
    plan: PreparedMission, options: RunOptions, telemetry: Telemetry, folder: RunFolder | None
) -> Engine:
    """Build everything and connect it; the first step may follow."""
    seed, robot = options.seed, plan.robot
    log = folder.log if folder is not None else _nowhere
    body = SimulatedBody(robot, plan.world, start=plan.start, seed=seed)
    body.pace = options.speed
    for warning in (*plan.world.warnings, *plan.warnings):
        where = f"{Path(warning.mark.file).name}:{warning.mark.line}"
        telemetry.emit("world", f"{where} {warning.sentence}", source="world", level="warning")
    rates = Rates()
    period = 1.0 / rates.control
    grid = _map_of(plan)
    local, whole = _costmaps(plan, _ground_of(plan, grid))
    guard = plan.choices["safety"]
    safety = Safety(robot, guard.parameters, period, guard.parts)
    navigator = _navigation(plan, period, local, whole, telemetry)
    localiser = _localiser(plan, grid, seed)
    controller = navigator.controller
    tracker = _tracker(plan, grid, local, whole)
    facade = RobotFacade(
        FacadeParts(
            body=body,
            navigator=navigator,
            estimator=localiser,
            local_costmap=local,
            global_costmap=whole,
            store=PictureStore(folder),
            emit=_emitter(telemetry, "navigation"),
            markers=plan.world.markers,
            detector=MarkerDetector(plan.world.markers) if robot.camera else None,
            cover=_leave_as_it_is if plan.is_mapped else Ground(grid, [whole]).cover,
            forget_tracks=_leave_as_it_is if tracker is None else tracker.clear,
            tunables={
                "controller": Tunable.of(controller),
                "navigator": Tunable.of(navigator),
                "safety": Tunable.of(safety),
                "local_costmap": Tunable.of(local),
                "global_costmap": Tunable.of(whole),
            },
        )
    )
    tree = compile_mission(plan.mission)
    tree.setup(facade, tree_emitter(telemetry), log)
    debugger = TreeDebugger(tree)
    announce_tree(telemetry, tree)
    scorer = SimulationScorer(body, plan.world)
    parts = Parts(
        body=body, fusion=OdometryFusion(), localiser=localiser, local_costmap=local,
        global_costmap=whole, navigator=navigator, facade=facade, safety=safety,
        tree=tree, telemetry=telemetry, map_layer=Layer(1, grid), scorer=scorer,
        tracker=tracker, debugger=debugger,
        keep_camera_on=options.camera == "on",
    )  # fmt: skip
    runtime = Runtime(parts, rates, _idle)
    for command in options.first_commands():
        ack = runtime.apply(command)
        if not ack.done:
            raise InputError(ack.reason)
    return Engine(runtime, body, tree, telemetry, scorer, debugger)


def announce_tree(telemetry: Telemetry, tree: MissionTree) -> None:
    """Tell the records which nodes there are: what the numbers in later events mean."""
    rows = [
        [node.id, node.parent, node.kind, node.names[0], node.where] for node in addresses(tree)
    ]
    telemetry.emit("tree", f"{len(rows)} nodes", source="tree", rows=rows)


def _map_of(plan: PreparedMission) -> OccupancyGrid:
    """The map that the mission names, or unknown ground round the start when it names none.

    Drawing the world's map needs OpenCV, so not before a run.
    """
    if plan.mission.map == "from_world":
        from stack.sim.worlds.rasterise import rasterise

        return rasterise(replace(plan.world, start=plan.start))
    if plan.mission.map == "none":
        resolution = plan.choices["costmap"].parameters.resolution
        return unexplored([plan.belief or NOWHERE], resolution)
    return load_map(plan.mission.map, plan.mission.source.parent)


def _ground_of(plan: PreparedMission, grid: OccupancyGrid) -> OccupancyGrid:
    """The map for the costmaps: drawn finer than the localiser needs it, where it can be.

    At 5 cm a door askew to the cells can lose 7 cm on either side.
    """
    resolution = plan.choices["costmap"].parameters.map_resolution
    if plan.mission.map != "from_world" or resolution == grid.resolution:
        return grid
    from stack.sim.worlds.rasterise import rasterise

    return rasterise(replace(plan.world, start=plan.start), resolution)


def _costmaps(plan: PreparedMission, grid: OccupancyGrid) -> tuple[Costmap, Costmap]:
    """The local and the global one, each with the layers that it is to have."""
    choice, footprint = plan.choices["costmap"], plan.robot.footprint
    layers = {
        name: [layer for layer in choice.parts if layer.only in ("both", name)]
        for name in ("local", "global")
    }
    costs = choice.parameters
    static = grid if plan.is_mapped else None
    local = Costmap(costs, footprint, static, window=LOCAL_WINDOW, layers=layers["local"])
    return local, Costmap(costs, footprint, grid, layers=layers["global"])


def _tracker(plan: PreparedMission, grid: OccupancyGrid, *costmaps: Costmap) -> Tracker | None:
    """Somebody who follows moving things, where a costmap's layer or the controller asks for it."""
    for_controller = getattr(plan.choices["controller"].component, "needs_tracks", False)
    if not (for_controller or any(costmap.needs_tracks for costmap in costmaps)):
        return None
    return Tracker(plan.choices["tracker"].parameters, grid)


def _emitter(telemetry: Telemetry, source: str) -> Callable[..., None]:
    def emit(kind: str, text: str, level: str = "info", **fields: Any) -> None:
        said_by = "mission" if kind == "say" else source
        telemetry.emit(kind, text, source=said_by, level=level, **fields)

    return emit


def tree_emitter(telemetry: Telemetry) -> Callable[..., None]:
    """What a tree tells its events."""

    def emit(level: str, kind: str, text: str, fields: Mapping[str, Any]) -> None:
        telemetry.emit(kind, text, source="tree", level=level, **fields)

    return emit


def _navigation(
    plan: PreparedMission, period: float, local: Costmap, whole: Costmap, telemetry: Telemetry
) -> Navigator:
    planner, controller = plan.choices["planner"], plan.choices["controller"]
    return Navigator(
        robot=plan.robot,
        planner=planner.component(planner.parameters, plan.robot),
        controller=controller_for(controller.component, controller.parameters, plan.robot, period),
        parameters=plan.choices["navigator"].parameters,
        local_costmap=local,
        global_costmap=whole,
        emit=_emitter(telemetry, "navigation"),
        period=period,
    )


def _nowhere(text: str) -> None:
    """Where log lines go without a run folder."""


def _idle() -> None:
    """While the robot is held nothing moves; do not spin on the processor."""
    sleep(IDLE_SECONDS)


def _leave_as_it_is(poses: Iterable[Pose2D] = ()) -> None:
    """A map ends where it ends; nobody follows anything."""


def _localiser(plan: PreparedMission, grid: OccupancyGrid, seed: int) -> Localiser | DeadReckoning:
    if not plan.is_mapped:
        return DeadReckoning(plan.belief or NOWHERE)
    sideways = plan.robot.drive is DriveKind.OMNI
    localiser = Localiser(grid, LocaliserParameters(), seed, sideways=sideways)
    if plan.belief is None:
        localiser.scatter()
    else:
        localiser.start(plan.belief, position_deviation=0.1, heading_deviation=0.05)
    return localiser
