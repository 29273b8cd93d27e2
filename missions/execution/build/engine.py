"""Build the parts of a prepared mission: body, estimator, costmaps, navigation, tree, telemetry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import sleep  # noqa: TID251 - only while the simulation is held

from missions.commissioning.preflight import require_ready
from missions.execution.build.detour import detour_maker
from missions.execution.build.driving import DrivingInput, driving_of, place_of
from missions.execution.build.events import announce_tree, announce_warnings, emitter, tree_emitter
from missions.execution.build.world import landmarks_of, map_of
from missions.execution.fit.arms import boxes_of, others_of
from missions.execution.fit.faults import world_of
from missions.execution.ground_truth import SimulationScorer
from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.records.picture_store import FolderMapStore, PictureStore
from missions.execution.resources import map_folder
from missions.trees.compiler import compile_mission
from missions.trees.debugging import TreeDebugger
from missions.trees.mission_tree import MissionTree
from robots.bodies import BodySetup, MakeBody, chosen_body, playing
from stack.body import Body, Replay, SimulatedWorld
from stack.components import Controller
from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import BodyError, InputError
from stack.frames.buffer import TransformBuffer
from stack.frames.links import RobotLinks
from stack.navigation.capabilities.limbs import ArmStage
from stack.navigation.capabilities.perception import StackPerception
from stack.navigation.capabilities.robot import StackRobot
from stack.navigation.capabilities.surroundings import Surroundings, reach_of
from stack.navigation.live_parameters import LiveParameters, Tunable
from stack.navigation.plans.arm_plans import ArmPlans
from stack.navigation.tasks import Emit
from stack.perception.blocks import BlockDetector
from stack.perception.calibration_watch import CalibrationWatch
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
from stack.runtime.failsafes import Failsafes
from stack.runtime.holdups import Holdups
from stack.runtime.interfaces import LoopParts
from stack.runtime.loop import Runtime
from stack.runtime.perceiver import Perceiver
from stack.telemetry.hub import Telemetry, discard
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Layer, RunInfo, new_identity
from stack.telemetry.sensor_log import SensorLog
from stack.types import CurrentStep, FloatArray, OccupancyGrid, Perceived

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
        origin=plan.world.origin,
        drives=plan.robot.drivetrain.moves,
    )


def build(  # noqa: PLR0913 - the optional ones by keyword
    plan: PreparedMission, options: RunOptions, telemetry: Telemetry, folder: RunFolder | None,
    make_body: MakeBody | None = None, *, tell: Callable[[str], None] = discard,
    interrupted: Callable[[], bool] = lambda: False,
) -> Engine:  # fmt: skip
    """Build and connect all parts; the engine is then ready for its first step.

    Args:
        plan: the checked mission.
        options: of the run.
        telemetry: receives events and snapshots.
        folder: of the run; None writes no records.
        make_body: makes the body; None: the choice of the options or of the robot file.
        tell: writes a line for people while the body is made.
        interrupted: whether the user has given up waiting for the robot.

    Raises:
        BodyError: the robot cannot be reached, or may not drive.
        InputError: a breakpoint or a forced outcome of the options is refused.
    """
    log = folder.log if folder is not None else discard
    world = world_of(plan.world, plan.faults, plan.robot, plan.start, options.seed)
    setup = BodySetup(
        plan.robot, world, plan.start, options.seed, options.speed, tell, interrupted, plan.faults
    )
    body = _body(plan, options, setup, make_body, emitter(telemetry, "body"))
    announce_warnings(plan, telemetry)
    loop, emit = plan.choices["loop"].parameters, emitter(telemetry, "navigation")
    grid = map_of(plan)
    perceiver = _perceiver(plan, grid, options, body, telemetry, log)
    now = CurrentStep(Perceived(body.time, perceiver.estimator.estimate))
    holdups = Holdups(partial(telemetry.emit, source="safety"), loop.period, landmarks_of(plan))
    failsafes = Failsafes(plan.choices["failsafe"].parameters, telemetry.emit)
    maps = FolderMapStore(folder, plan.mission.source.parent)
    plans = ArmPlans(plan.robot, options.seed, log, is_real_time=body.is_real_time)
    around = Surroundings(
        tuple(boxes_of(plan.world).values()), others_of(plan.world), reach_of(plan.robot)
    )
    limbs = ArmStage(
        plan.robot, now, plans, around, perceiver.depth_camera, emitter(telemetry, "arm")
    )
    given = DrivingInput(
        perceiver, grid, maps, now, emit, log, limbs, holdups.sentence, body.is_real_time
    )
    driving = driving_of(plan, given)
    coloured = ColouredObjectDetector(plan.choices["coloured_objects"].parameters)
    robot = StackRobot(
        driving.base, driving.localisation, driving.map,
        _perception(plan.robot, perceiver, coloured, now, emit),
        body, now, PictureStore(folder), emit, limbs,
    )  # fmt: skip
    tree = compile_mission(plan.mission)
    tree.setup(robot, tree_emitter(telemetry), log)
    debugger = TreeDebugger(tree)
    announce_tree(telemetry, tree)
    simulation = body if isinstance(body, SimulatedWorld) else None
    scorer = (
        None
        if simulation is None
        else SimulationScorer(simulation, world, plan.robot.footprint, lambda: body.time)
    )
    sensor_log = _sensor_log(plan, options, folder)
    tuned = {**driving.tunables, **_tunables(failsafes, perceiver, coloured)}
    tuning = LiveParameters(tuned, emit)
    detours = detour_maker(plan.mission, plan.robot, robot, log)
    parts = LoopParts(
        body, perceiver, now, tree, robot, driving.navigator, driving.safety, limbs, tuning,
        telemetry, holdups, failsafes, scorer, debugger, sensor_log, detours,
    )  # fmt: skip
    runtime = Runtime(parts, loop, _idle)
    for command in options.first_commands():
        ack = runtime.apply(command)
        if not ack.done:
            raise InputError(ack.reason)
    replay = body if isinstance(body, Replay) else None
    return Engine(runtime, body, tree, telemetry, debugger, simulation, replay, scorer, sensor_log)


def _perceiver(  # noqa: PLR0913 - what it needs of the engine
    plan: PreparedMission, grid: OccupancyGrid, options: RunOptions, body: Body,
    telemetry: Telemetry, log: Callable[[str], None],
) -> Perceiver:  # fmt: skip
    robot, choices = plan.robot, plan.choices
    place = place_of(plan, grid, options.seed)
    if body.is_real_time:
        place.estimator.run_in_real_time()
    controller: type[Controller] = choices["controller"].component
    always = options.camera == "on" or controller.takes_pictures(choices["controller"].parameters)
    camera = CameraLease(CAMERA_TIME, always=always)
    detection = choices["object_detector"].parameters
    costmaps = place.world_model.costmaps.values()
    objects = ObjectDetection(
        detection, load_model(detection) if robot.camera else None, camera,
        emitter(telemetry, "perception"), log,
        needed=any(costmap.needs_detections for costmap in costmaps),
        is_real_time=body.is_real_time,
    )  # fmt: skip
    return Perceiver(
        odometry=place.odometry,
        frames=TransformBuffer(choices["loop"].parameters.pose_history),
        estimator=place.estimator,
        cameras=CameraWatch(robot, choices["cameras"].parameters),
        depth_scans=DepthScans(robot),
        markers=MarkerStage(_marker_detector(plan), choices["markers"].parameters),
        places=_places(plan),
        depth=DepthObstacles(robot, choices["depth"].parameters),
        obstacle_memory=ObstacleMemory(robot, choices["obstacle_memory"].parameters),
        objects=objects,
        world_model=place.world_model,
        camera=camera,
        depth_camera=CameraLease(CAMERA_TIME),
        map_layer=Layer(1, grid),
        is_mapped=plan.is_mapped,
        emit=emitter(telemetry, "navigation"),
    )


def _perception(
    robot: RobotDescription, perceiver: Perceiver, coloured: ColouredObjectDetector,
    now: CurrentStep, emit: Emit,
) -> StackPerception:  # fmt: skip
    return StackPerception(
        robot=robot,
        now=now,
        frames=perceiver.frames,
        estimator=perceiver.estimator,
        camera=perceiver.camera,
        depth_camera=perceiver.depth_camera,
        objects=perceiver.objects,
        places=perceiver.places,
        detector=perceiver.markers.detector,
        lines=FloorLineDetector(),
        coloured=coloured,
        block_detector=BlockDetector(_arm_base(robot)),
        calibration=CalibrationWatch(),
        emit=emit,
    )


def _arm_base(robot: RobotDescription) -> FloatArray:
    """Return the pose (4, 4) of the arm's base link in the base frame; without an arm, its own."""
    link = BASE if robot.arm is None else robot.arm.base_link
    return RobotLinks(robot.links, BASE).pose(link, {})


def _marker_detector(plan: PreparedMission) -> MarkerDetector | None:
    """Return the detector of the markers that the mission knows, and of those it surveys."""
    if plan.robot.camera is None:
        return None
    settings: MarkerParameters = plan.choices["markers"].parameters
    surveyed = (settings.surveyed_dictionary,) if settings.survey else ()
    return MarkerDetector(plan.markers, settings, surveyed)


def _body(
    plan: PreparedMission, options: RunOptions, setup: BodySetup, make_body: MakeBody | None,
    emit: Emit,
) -> Body:  # fmt: skip
    """Return the body; a real one has passed the preflight checks without motion.

    Raises:
        BodyError: the robot cannot be reached, or a check failed.
    """
    if plan.recording is not None:
        replay = plan.mission.replay if options.replay is None else None
        return playing(plan.recording.play(), 0.0 if replay is None else replay.after)(setup)
    body = (make_body or chosen_body(plan.robot, options.body))(setup)
    if body.is_real_time and options.skip_preflight:
        emit("preflight", "preflight skipped (--skip-preflight)", level="warning", checks=[])
    elif body.is_real_time:
        try:
            require_ready(body, emit)
        except BodyError:
            body.close()
            raise
    return body


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


def _tunables(
    failsafes: Failsafes, perceiver: Perceiver, coloured: ColouredObjectDetector
) -> dict[str, Tunable]:
    return {
        "failsafe": failsafes,
        "depth": perceiver.depth,
        "cameras": perceiver.cameras,
        "coloured_objects": coloured,
        "object_detector": perceiver.objects,
        "markers": perceiver.markers,
        "place_recognition": perceiver.places,
    }


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
