"""Build what drives the robot: pose, world model, navigator and safety; or none for a fixed base.

Only here it matters whether a robot has wheels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from missions.execution.build.world import landmarks_of, world_model_of
from missions.execution.prepare import PreparedMission
from missions.execution.records.picture_store import FolderMapStore
from missions.execution.resources import map_folder
from missions.language.reading.header import LOCALISATION, ODOMETRY
from stack.components import Estimator, OdometryFusion
from stack.control.evasion.evasion import Evasion
from stack.control.path_follower import PathFollower
from stack.localisation.fixed_base import FixedOdometry, KnownPose
from stack.navigation.capabilities.base import StackBase
from stack.navigation.capabilities.localisation import StackLocalisation
from stack.navigation.capabilities.map import StackMap
from stack.navigation.drive_tools import DriveTools
from stack.navigation.fixed_base import KnownPlace, NoWorldModel, Standing, StandingSafety
from stack.navigation.live_parameters import Tunable
from stack.navigation.motion_stage import DriveInterlock, MotionStage
from stack.navigation.navigator import Navigator
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.navigation.tasks import Emit
from stack.navigation.world_model import WorldModel, WorldStage
from stack.planning.outline_check import outline_checked
from stack.robot import Localisation
from stack.runtime.perceiver import Perceiver
from stack.safety.safety import Safety
from stack.safety.stage import SafetyStage
from stack.types import CurrentStep, OccupancyGrid


@dataclass(frozen=True)
class Place:
    """What tells where the robot is, and what it keeps of its surroundings."""

    odometry: OdometryFusion
    estimator: Estimator
    world_model: WorldStage


@dataclass(frozen=True)
class Driving:
    """The stages that move the base, and the capabilities that behaviours ask for.

    Attributes:
        base: None if it is fixed.
        map: None for a fixed base.
        tunables: components whose parameters can change while they run, by name.
    """

    navigator: MotionStage
    safety: SafetyStage
    base: StackBase | None
    localisation: Localisation
    map: StackMap | None
    tunables: dict[str, Tunable]


@dataclass(frozen=True)
class DrivingInput:
    """What `driving_of` connects the stages to.

    Attributes:
        grid: the map.
        maps: where maps are saved.
        now: what the step has perceived.
        emit: of events of navigation.
        log: receives tracebacks.
        interlock: holds the base while another part of the robot is in the way.
        held: what held the robot between two times, as a sentence.
        is_real_time: whether the body's clock goes on by itself.
    """

    perceiver: Perceiver
    grid: OccupancyGrid
    maps: FolderMapStore
    now: CurrentStep
    emit: Emit
    log: Callable[[str], None]
    interlock: DriveInterlock
    held: Callable[[float, float], str]
    is_real_time: bool


def place_of(plan: PreparedMission, grid: OccupancyGrid, seed: int) -> Place:
    """Return odometry, estimator and world model, started at the initial pose."""
    if not plan.robot.drivetrain.moves:
        known = KnownPose(plan.robot)
        known.start(plan.belief)
        return Place(FixedOdometry(None, plan.robot), known, NoWorldModel())
    odometry: OdometryFusion = plan.choices[ODOMETRY].create(plan.robot)
    return Place(odometry, _estimator(plan, grid, seed), world_model_of(plan, grid))


def driving_of(plan: PreparedMission, given: DrivingInput) -> Driving:
    """Return the stages that move the base."""
    if not isinstance(given.perceiver.world_model, WorldModel):
        place = KnownPlace(given.now)
        return Driving(Standing(), StandingSafety(), None, place, None, {})
    world, perceiver = given.perceiver.world_model, given.perceiver
    navigator = _navigator(plan, world, given)
    choice, period = plan.choices["safety"], plan.choices["loop"].parameters.period
    safety = Safety(plan.robot, choice.parameters, period, choice.parts)
    localisation = StackLocalisation(
        perceiver.estimator, navigator, perceiver.frames, given.now, given.emit
    )
    known = StackMap(
        plan.robot, perceiver.estimator, world, given.grid if plan.is_mapped else None, given.maps,
        given.emit, perceiver.markers.survey, plan.markers, perceiver.places,
    )  # fmt: skip
    tunables = _tunables(navigator, safety, world, perceiver)
    return Driving(navigator, safety, navigator.base, localisation, known, tunables)


def _tunables(
    navigator: Navigator, safety: Safety, world: WorldModel, perceiver: Perceiver
) -> dict[str, Tunable]:
    return {
        "controller": navigator.tools.path_follower,
        "goal_checker": navigator.tools.goal_checker,
        "progress_checker": navigator.tools.progress_checker,
        "navigator": navigator.tools,
        "safety": safety,
        "evasion": navigator.evasion,
        "local_costmap": world.local_costmap,
        "global_costmap": world.global_costmap,
        "localisation": perceiver.estimator,
        "odometry": perceiver.odometry,
        "obstacle_memory": perceiver.obstacle_memory,
    }


def _navigator(plan: PreparedMission, world: WorldModel, given: DrivingInput) -> Navigator:
    choices, robot = plan.choices, plan.robot
    controller, period = choices["controller"], choices["loop"].parameters.period
    planner = outline_checked(choices["planner"], robot)
    tools = DriveTools(
        robot=robot,
        path_follower=PathFollower(controller.created_with, controller.parameters, robot, period),
        goal_checker=choices["goal_checker"].create(robot),
        progress_checker=choices["progress_checker"].create(robot),
        planner_worker=PlannerWorker(planner, given.log, is_real_time=given.is_real_time),
        parameters=choices["navigator"].parameters,
        local_costmap=world.local_costmap,
        global_costmap=world.global_costmap,
        emit=given.emit,
        period=period,
        held=given.held,
        landmarks=landmarks_of(plan),
    )
    evasion = Evasion(robot, choices["evasion"].parameters)
    estimator = given.perceiver.estimator
    return Navigator(tools, evasion, estimator, given.now, world.cover, given.log, given.interlock)


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
