"""Build the parts of a prepared mission: body, estimator, costmaps, navigation, tree, telemetry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import sleep  # noqa: TID251 - only while the simulation is held
from typing import Any

from missions.execution.ground_truth import SimulationScorer
from missions.execution.prepare import MAP_ORIGIN, PreparedMission, RunOptions
from missions.execution.records.picture_store import FolderMapStore, PictureStore
from missions.execution.resources import load_map, map_folder, versions
from missions.language.reading.header import LOCALISATION, ODOMETRY
from missions.trees.compiler import compile_mission
from missions.trees.debugging import TreeDebugger, addresses
from missions.trees.mission_tree import MissionTree
from robots.bodies import BodySetup, MakeBody, find_body
from stack.body import Body, SimulatedWorld
from stack.components import Controller, Estimator, OdometryFusion
from stack.control.evasion.evasion import Evasion
from stack.control.path_follower import PathFollower
from stack.costmap.costmap import Costmap
from stack.costmap.speed_limits import SpeedLimits
from stack.costmap.unexplored import Ground, resampled, unexplored
from stack.documents.files import URDF_BYTES, decoded, read_input
from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.navigation.facade.parts import FacadeParts
from stack.navigation.facade.robot_facade import RobotFacade
from stack.navigation.loop_state import LoopState
from stack.navigation.map_service import MapService
from stack.navigation.navigator import Navigator
from stack.navigation.tuning import Tunable
from stack.navigation.world_model import WorldModel
from stack.perception.camera_lease import CameraLease
from stack.perception.cameras.watch import CameraWatch
from stack.perception.coloured_objects import ColouredObjectDetector
from stack.perception.depth.obstacles import DepthObstacles
from stack.perception.depth.scan import DepthScans
from stack.perception.floor_lines import FloorLineDetector
from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.stage import MarkerStage
from stack.perception.objects.detection import ObjectDetection, load_model
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.places.descriptor import load_descriptor
from stack.perception.places.memory import PlaceMemory
from stack.perception.tracking.tracker import Tracker
from stack.runtime.interfaces import Parts
from stack.runtime.loop import Runtime
from stack.safety.parameters import SafetyParameters
from stack.safety.safety import Safety
from stack.telemetry.hub import Telemetry
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Layer, RunInfo, new_identity
from stack.telemetry.sensor_log import SensorLog
from stack.types import OccupancyGrid

IDLE_SECONDS = 0.01
"""Wall seconds between two checks for commands while the robot is held."""


@dataclass
class Engine:
    """A runtime ready to step, with the parts that are closed after the run.

    Attributes:
        simulation: the body as a simulated world; None for other bodies.
        scorer: compares with the ground truth; only in a simulation.
        between_steps: called before each step.
    """

    runtime: Runtime
    body: Body
    tree: MissionTree
    telemetry: Telemetry
    debugger: TreeDebugger
    simulation: SimulatedWorld | None = None
    scorer: SimulationScorer | None = None
    sensor_log: SensorLog | None = None
    between_steps: Callable[[], None] = lambda: None


def run_info(plan: PreparedMission, run_id: str, seed: int, identity: str = "") -> RunInfo:
    """Return the description of the run that every sink receives when it opens."""
    return RunInfo(
        run_id=run_id,
        mission=plan.mission.source.stem,
        title=plan.mission.name,
        robot=plan.robot.name,
        world=plan.world.name,
        seed=seed,
        footprint=plan.robot.footprint,
        markers=plan.markers,
        urdf=decoded(read_input(plan.robot.urdf, "URDF", URDF_BYTES), plan.robot.urdf),
        versions=versions(),
        places=dict(plan.mission.places),
        identity=identity or new_identity(),
    )


def build(
    plan: PreparedMission, options: RunOptions, telemetry: Telemetry, folder: RunFolder | None,
    make_body: MakeBody | None = None,
) -> Engine:  # fmt: skip
    """Build and connect all parts; the engine is then ready for its first step.

    Args:
        plan: the checked mission.
        options: of the run.
        telemetry: receives events and snapshots.
        folder: of the run; None writes no records.
        make_body: makes the body; None: the choice of the options or of the robot file.

    Raises:
        InputError: a breakpoint or a forced outcome of the options is refused.
    """
    seed, robot = options.seed, plan.robot
    log = folder.log if folder is not None else _discard
    body = _body(plan, options, make_body)
    _announce_warnings(plan, telemetry)
    loop = plan.choices["loop"].parameters
    period = loop.period
    grid = _map_of(plan)
    world_model = _world_model(plan, grid)
    local_costmap, global_costmap = world_model.local_costmap, world_model.global_costmap
    safety_choice = plan.choices["safety"]
    safety = Safety(robot, safety_choice.parameters, period, safety_choice.parts)
    navigator = _navigator(plan, period, (local_costmap, global_costmap), telemetry, log)
    if body.is_real_time:
        navigator.configure(replace(navigator.parameters, wait_for_plan=False))
    estimator = _estimator(plan, grid, seed)
    if body.is_real_time:
        estimator.run_in_real_time()
    odometry: OdometryFusion = plan.choices[ODOMETRY].create(robot)
    obstacle_memory = ObstacleMemory(robot, plan.choices["obstacle_memory"].parameters)
    depth = DepthObstacles(robot, plan.choices["depth"].parameters)
    cameras = CameraWatch(robot, plan.choices["cameras"].parameters)
    coloured_objects = ColouredObjectDetector(plan.choices["coloured_objects"].parameters)
    detector = _marker_detector(plan)
    markers = MarkerStage(detector, plan.choices["markers"].parameters)
    places = _places(plan)
    frames, state = TransformBuffer(loop.pose_history), LoopState()
    camera = CameraLease(loop.camera_time, always=options.camera == "on")
    objects = ObjectDetection(
        plan.choices["object_detector"].parameters,
        load_model(plan.choices["object_detector"].parameters) if robot.camera else None,
        camera, _emitter(telemetry, "perception"), log,
        needed=local_costmap.needs_detections or global_costmap.needs_detections,
    )  # fmt: skip
    if body.is_real_time:
        objects.run_in_real_time()
    depth_camera = CameraLease(loop.camera_time)
    maps = MapService(
        robot, estimator, global_costmap, grid if plan.is_mapped else None,
        FolderMapStore(folder, plan.mission.source.parent), markers.survey, plan.markers, places,
    )  # fmt: skip
    facade = RobotFacade(
        FacadeParts(
            robot=robot,
            state=state,
            clock=lambda: body.time,
            frames=frames,
            camera=camera,
            depth_camera=depth_camera,
            navigator=navigator,
            estimator=estimator,
            local_costmap=local_costmap,
            global_costmap=global_costmap,
            store=PictureStore(folder),
            maps=maps,
            recording_over=lambda: body.recording_over,
            emit=_emitter(telemetry, "navigation"),
            markers=plan.markers,
            detector=detector,
            floor_lines=FloorLineDetector() if robot.camera else None,
            coloured_objects=coloured_objects if robot.camera else None,
            objects=objects,
            places=places,
            cover=world_model.cover,
            draw=world_model.draw,
            forget_tracks=_in_turn(world_model.forget_tracks, objects.forget),
            tunables={
                **_tunables_of(navigator),
                "safety": Tunable.of(safety),
                "evasion": Tunable.of(navigator.evasion),
                "local_costmap": Tunable.of(local_costmap),
                "global_costmap": Tunable.of(global_costmap),
                "localisation": Tunable.of(estimator),
                "odometry": Tunable.of(odometry),
                "depth": Tunable.of(depth),
                "cameras": Tunable.of(cameras),
                "coloured_objects": Tunable.of(coloured_objects),
                "object_detector": Tunable.of(objects),
                "markers": Tunable.of(markers),
                "place_recognition": Tunable.of(places),
                "obstacle_memory": Tunable.of(obstacle_memory),
            },
        )
    )
    tree = compile_mission(plan.mission)
    tree.setup(facade, tree_emitter(telemetry), log)
    debugger = TreeDebugger(tree)
    announce_tree(telemetry, tree)
    simulation = body if isinstance(body, SimulatedWorld) else None
    scorer = (
        None
        if simulation is None
        else SimulationScorer(simulation, plan.world, robot.footprint, lambda: body.time)
    )
    sensor_log = _sensor_log(plan, options, folder)
    parts = Parts(
        body=body, odometry=odometry, frames=frames, estimator=estimator,
        cameras=cameras, markers=markers, places=places, depth_scans=DepthScans(robot), depth=depth,
        obstacle_memory=obstacle_memory, objects=objects, world_model=world_model, tree=tree,
        facade=facade,
        navigator=navigator, safety=safety, camera=camera,
        depth_camera=depth_camera, telemetry=telemetry, state=state,
        map_layer=Layer(1, grid), is_mapped=plan.is_mapped, scorer=scorer, debugger=debugger,
        sensor_log=sensor_log,
    )  # fmt: skip
    runtime = Runtime(parts, loop, _idle)
    for command in options.first_commands():
        ack = runtime.apply(command)
        if not ack.done:
            raise InputError(ack.reason)
    return Engine(runtime, body, tree, telemetry, debugger, simulation, scorer, sensor_log)


def _marker_detector(plan: PreparedMission) -> MarkerDetector | None:
    """Return the detector of the markers that the mission knows, and of those it surveys."""
    if plan.robot.camera is None:
        return None
    settings: MarkerParameters = plan.choices["markers"].parameters
    surveyed = (settings.surveyed_dictionary,) if settings.survey else ()
    return MarkerDetector(plan.markers, settings, surveyed)


def _body(plan: PreparedMission, options: RunOptions, make_body: MakeBody | None) -> Body:
    setup = BodySetup(plan.robot, plan.world, plan.start, options.seed, options.speed)
    recording = plan.recording
    if recording is not None:
        replay = plan.mission.replay if options.replay is None else None
        setup = replace(
            setup, recording=recording.play(), epoch=recording.epoch,
            after=0.0 if replay is None else replay.after,
        )  # fmt: skip
        make_body = find_body("replayed")
    make = make_body or find_body(options.body or plan.robot.body)
    return make(setup)


def _announce_warnings(plan: PreparedMission, telemetry: Telemetry) -> None:
    """Emit the warnings about files, and that the robot does not see if it has no range sensor."""
    for warning in (*plan.world.warnings, *plan.warnings):
        where = f"{Path(warning.mark.file).name}:{warning.mark.line}"
        telemetry.emit("world", f"{where} {warning.sentence}", source="world", level="warning")
    if plan.recording is not None:
        for note in plan.recording.notes:
            text = f"{plan.recording.file.name}: {note}"
            telemetry.emit("recording", text, source="body", level="warning")
    robot = plan.robot
    if not (robot.all_lidars or robot.sonars):
        telemetry.emit(
            "safety",
            f"{robot.name} has no lidar and no sonar: it does not see obstacles and drives at most"
            f" {plan.choices['safety'].parameters.blind_speed:g} m/s",
            source="safety", level="warning",
        )  # fmt: skip


def _sensor_log(
    plan: PreparedMission, options: RunOptions, folder: RunFolder | None
) -> SensorLog | None:
    if "sensors" not in options.record or folder is None:
        return None
    about = {
        "mission": plan.mission.source.stem,
        "robot": plan.robot.name,
        "world": plan.world.name,
        "seed": str(options.seed),
    }
    return SensorLog(folder.sensors, about)


def _tunables_of(navigator: Navigator) -> dict[str, Tunable]:
    return {
        "controller": Tunable.of(navigator.path_follower),
        "goal_checker": Tunable.of(navigator.goal_checker),
        "progress_checker": Tunable.of(navigator.progress_checker),
        "navigator": Tunable.of(navigator),
    }


def _world_model(plan: PreparedMission, grid: OccupancyGrid) -> WorldModel:
    """Return costmaps, tracker and speed limits; without a map, the map grows with the robot."""
    local_costmap, global_costmap = _costmaps(plan, _costmap_grid(plan, grid))
    ground = None if plan.is_mapped else Ground(grid, [global_costmap])
    return WorldModel(
        local_costmap, global_costmap, _tracker(plan, grid, local_costmap, global_costmap),
        SpeedLimits(plan.choices["speed_limits"].parameters), lidar=plan.robot.main_lidar,
        deceleration=plan.robot.limits.linear_deceleration,
        cover=_ignore if ground is None else ground.cover,
        draw=_replacing(local_costmap, global_costmap) if ground is None else ground.draw,
    )  # fmt: skip


def _replacing(*costmaps: Costmap) -> Callable[[OccupancyGrid], None]:
    """Return the function that replaces the known map of costmaps, at their resolution."""

    def draw(grid: OccupancyGrid) -> None:
        for costmap in costmaps:
            costmap.set_static(resampled(grid, costmap.marks.resolution))

    return draw


def announce_tree(telemetry: Telemetry, tree: MissionTree) -> None:
    """Emit the `tree` event: one row per node, so that later events can name nodes by number."""
    rows = [
        [node.id, node.parent, node.kind, node.names[0], node.where] for node in addresses(tree)
    ]
    telemetry.emit("tree", f"{len(rows)} nodes", source="tree", rows=rows)


def _map_of(plan: PreparedMission) -> OccupancyGrid:
    """Return the mission's map; without one, an unknown map around the start."""
    if plan.mission.map == "from_world":
        from stack.sim.worlds.rasterise import rasterise  # imports OpenCV, so only for a run

        return rasterise(replace(plan.world, start=plan.start))
    if plan.mission.map == "none":
        resolution = plan.choices["costmap"].parameters.resolution
        return unexplored([plan.belief or MAP_ORIGIN], resolution)
    return load_map(plan.mission.map, plan.mission.source.parent)


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


def _tracker(plan: PreparedMission, grid: OccupancyGrid, *costmaps: Costmap) -> Tracker | None:
    """Return a tracker of moving objects if a part of the stack needs one."""
    controller: type[Controller] = plan.choices["controller"].component
    safety: SafetyParameters = plan.choices["safety"].parameters
    navigates = controller.needs_tracks or any(costmap.needs_tracks for costmap in costmaps)
    evades = plan.choices["evasion"].parameters.when != "never"
    if not navigates and not safety.predict_motion and not evades:
        return None
    return Tracker(plan.choices["tracker"].parameters, grid)


def _in_turn(*actions: Callable[[], None]) -> Callable[[], None]:
    def act() -> None:
        for action in actions:
            action()

    return act


def _emitter(telemetry: Telemetry, source: str) -> Callable[..., None]:
    def emit(kind: str, text: str, level: str = "info", **fields: Any) -> None:
        sender = "mission" if kind == "say" else source
        telemetry.emit(kind, text, source=sender, level=level, **fields)

    return emit


def tree_emitter(telemetry: Telemetry) -> Callable[..., None]:
    """Return the function through which a tree emits its events."""

    def emit(level: str, kind: str, text: str, fields: Mapping[str, Any]) -> None:
        telemetry.emit(kind, text, source="tree", level=level, **fields)

    return emit


def _navigator(
    plan: PreparedMission,
    period: float,
    costmaps: tuple[Costmap, Costmap],
    telemetry: Telemetry,
    log: Callable[[str], None],
) -> Navigator:
    choices, robot = plan.choices, plan.robot
    controller = choices["controller"]
    return Navigator(
        robot=robot,
        planner=choices["planner"].create(robot),
        path_follower=PathFollower(controller.created_with, controller.parameters, robot, period),
        goal_checker=choices["goal_checker"].create(robot),
        progress_checker=choices["progress_checker"].create(robot),
        parameters=plan.choices["navigator"].parameters,
        evasion=Evasion(robot, choices["evasion"].parameters),
        local_costmap=costmaps[0],
        global_costmap=costmaps[1],
        emit=_emitter(telemetry, "navigation"),
        period=period,
        log=log,
    )


def _places(plan: PreparedMission) -> PlaceMemory:
    """Return the memory of places, with the keyframes that are saved with the map."""
    robot, parameters = plan.robot, plan.choices["place_recognition"].parameters
    has_camera = robot.camera is not None
    places = PlaceMemory(
        robot.main_lidar, has_camera=has_camera, parameters=parameters,
        descriptor=load_descriptor(parameters) if has_camera else None,
    )  # fmt: skip
    folder = map_folder(plan.mission.map, plan.mission.source.parent)
    if folder is not None:
        places.load(folder)
    return places


def _discard(text: str) -> None:
    """Drop a log line: there is no run folder."""


def _idle() -> None:
    """Sleep while the robot is held, so that the loop does not spin."""
    sleep(IDLE_SECONDS)


def _ignore(_: object = ()) -> None:
    """Do nothing: a known map does not grow, and without a tracker there are no tracks."""


def _estimator(plan: PreparedMission, grid: OccupancyGrid, seed: int) -> Estimator:
    """Return the chosen estimator, started at the initial pose."""
    choice = plan.choices[LOCALISATION]
    estimator: Estimator = choice.create(plan.robot, grid if plan.is_mapped else None, seed)
    folder = map_folder(plan.mission.map, plan.mission.source.parent)
    if estimator.loads_saved_maps and folder is not None:
        estimator.load_map(grid, folder, plan.belief)
    else:
        estimator.start(plan.belief)
    return estimator
