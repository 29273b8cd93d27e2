"""Build the parts of a prepared mission: body, estimator, costmaps, navigation, tree, telemetry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import sleep  # noqa: TID251 - only while the simulation is held

from missions.execution.build.events import announce_tree, announce_warnings, emitter, tree_emitter
from missions.execution.build.world import map_of, world_model_of
from missions.execution.ground_truth import SimulationScorer
from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.records.picture_store import FolderMapStore, PictureStore
from missions.execution.resources import map_folder
from missions.language.reading.header import LOCALISATION, ODOMETRY
from missions.trees.compiler import compile_mission
from missions.trees.debugging import TreeDebugger
from missions.trees.mission_tree import MissionTree
from robots.bodies import BodySetup, MakeBody, chosen_body, playing
from stack.body import Body, Replay, SimulatedWorld
from stack.components import Estimator, OdometryFusion
from stack.control.evasion.evasion import Evasion
from stack.control.path_follower import PathFollower
from stack.costmap.costmap import Costmap
from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.navigation.facade.parts import FacadeParts
from stack.navigation.facade.robot_facade import RobotFacade
from stack.navigation.map_service import MapService
from stack.navigation.navigator import Navigator
from stack.navigation.tuning import Tunable
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
from stack.planning.outline_check import outline_checked
from stack.runtime.interfaces import Parts
from stack.runtime.loop import Runtime
from stack.safety.safety import Safety
from stack.telemetry.hub import Telemetry, discard
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Layer, RunInfo, new_identity
from stack.telemetry.sensor_log import SensorLog
from stack.types import OccupancyGrid

CAMERA_TIME = 1.0
"""How long a request for pictures keeps the camera on, s."""

IDLE_SECONDS = 0.01
"""Wall seconds between two checks for commands while the robot is held."""


@dataclass
class Engine:
    """A runtime ready to step, with the parts that are closed after the run.

    Attributes:
        simulation: the body as a simulated world; None for other bodies.
        replay: the body as a replay; None for other bodies.
        scorer: compares with the ground truth; only in a simulation.
        between_steps: called before each step.
    """

    runtime: Runtime
    body: Body
    tree: MissionTree
    telemetry: Telemetry
    debugger: TreeDebugger
    simulation: SimulatedWorld | None = None
    replay: Replay | None = None
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
        urdf=plan.robot.model,
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
    log = folder.log if folder is not None else discard
    body = _body(plan, options, make_body)
    replay = body if isinstance(body, Replay) else None
    announce_warnings(plan, telemetry)
    loop = plan.choices["loop"].parameters
    period = loop.period
    grid = map_of(plan)
    world_model = world_model_of(plan, grid)
    local_costmap, global_costmap = world_model.local_costmap, world_model.global_costmap
    safety_choice = plan.choices["safety"]
    safety = Safety(robot, safety_choice.parameters, period, safety_choice.parts)
    navigator = _navigator(
        plan,
        (local_costmap, global_costmap),
        telemetry,
        log,
        is_real_time=body.is_real_time,
    )
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
    frames = TransformBuffer(loop.pose_history)
    camera = CameraLease(CAMERA_TIME, always=options.camera == "on")
    objects = ObjectDetection(
        plan.choices["object_detector"].parameters,
        load_model(plan.choices["object_detector"].parameters) if robot.camera else None,
        camera, emitter(telemetry, "perception"), log,
        needed=local_costmap.needs_detections or global_costmap.needs_detections,
        is_real_time=body.is_real_time,
    )  # fmt: skip
    depth_camera = CameraLease(CAMERA_TIME)
    maps = MapService(
        robot, estimator, global_costmap, grid if plan.is_mapped else None,
        FolderMapStore(folder, plan.mission.source.parent), markers.survey, plan.markers, places,
    )  # fmt: skip
    facade = RobotFacade(
        FacadeParts(
            robot=robot,
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
            recording_over=lambda: replay is not None and replay.recording_over,
            emit=emitter(telemetry, "navigation"),
            markers=plan.markers,
            detector=detector,
            floor_lines=FloorLineDetector() if robot.camera else None,
            coloured_objects=coloured_objects if robot.camera else None,
            objects=objects,
            places=places,
            cover=world_model.cover,
            draw=world_model.draw,
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
        depth_camera=depth_camera, telemetry=telemetry,
        map_layer=Layer(1, grid), is_mapped=plan.is_mapped, scorer=scorer, debugger=debugger,
        sensor_log=sensor_log,
    )  # fmt: skip
    runtime = Runtime(parts, loop, _idle)
    for command in options.first_commands():
        ack = runtime.apply(command)
        if not ack.done:
            raise InputError(ack.reason)
    return Engine(runtime, body, tree, telemetry, debugger, simulation, replay, scorer, sensor_log)


def _marker_detector(plan: PreparedMission) -> MarkerDetector | None:
    """Return the detector of the markers that the mission knows, and of those it surveys."""
    if plan.robot.camera is None:
        return None
    settings: MarkerParameters = plan.choices["markers"].parameters
    surveyed = (settings.surveyed_dictionary,) if settings.survey else ()
    return MarkerDetector(plan.markers, settings, surveyed)


def _body(plan: PreparedMission, options: RunOptions, make_body: MakeBody | None) -> Body:
    setup = BodySetup(plan.robot, plan.world, plan.start, options.seed, options.speed)
    if plan.recording is not None:
        replay = plan.mission.replay if options.replay is None else None
        return playing(plan.recording.play(), 0.0 if replay is None else replay.after)(setup)
    return (make_body or chosen_body(plan.robot, options.body))(setup)


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


def _navigator(
    plan: PreparedMission,
    costmaps: tuple[Costmap, Costmap],
    telemetry: Telemetry,
    log: Callable[[str], None],
    *,
    is_real_time: bool,
) -> Navigator:
    choices, robot = plan.choices, plan.robot
    controller, period = choices["controller"], choices["loop"].parameters.period
    return Navigator(
        robot=robot,
        planner=outline_checked(choices["planner"], robot),
        path_follower=PathFollower(controller.created_with, controller.parameters, robot, period),
        goal_checker=choices["goal_checker"].create(robot),
        progress_checker=choices["progress_checker"].create(robot),
        parameters=plan.choices["navigator"].parameters,
        evasion=Evasion(robot, choices["evasion"].parameters),
        local_costmap=costmaps[0],
        global_costmap=costmaps[1],
        emit=emitter(telemetry, "navigation"),
        period=period,
        log=log,
        is_real_time=is_real_time,
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


def _idle() -> None:
    """Sleep while the robot is held, so that the loop does not spin."""
    sleep(IDLE_SECONDS)


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
