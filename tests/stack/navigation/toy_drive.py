"""A whole navigation around a toy world: what a test sets up, and a step of the loop."""

from __future__ import annotations

from dataclasses import replace

from stack.control.checkers import (
    PoseProgressChecker,
    PoseProgressParameters,
    StoppedGoalChecker,
    StoppedGoalParameters,
)
from stack.control.evasion.evasion import Evasion
from stack.control.evasion.parameters import EvasionParameters
from stack.control.path_follower import PathFollower
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.navigation.drive_tools import DriveTools
from stack.navigation.motion_stage import DriveInterlock
from stack.navigation.navigator import Navigator
from stack.navigation.parameters import NavigationParameters
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.safety.parameters import SafetyParameters
from stack.types import CurrentStep, Perceived, WorldView
from tests.stack.navigation.toy_world import ToyCostmap, ToyPlanner, ToyWorld
from tests.stack.safety.obstacles import SafetyStage


class Belief:
    """An estimator that knows the pose, with what a toy drive says about it."""

    lidar = "lidar"

    def __init__(self, toy) -> None:
        self._toy = toy

    @property
    def estimate(self):
        toy = self._toy
        return replace(
            toy.world.estimate, health=toy.health, obscured=toy.obscured, rivals=toy.rivals
        )


class FreeToDrive(DriveInterlock):
    """The interlock of a robot that consists of its base."""

    def hindrance(self, perceived):
        return None

    def remove_hindrance(self, perceived, task):
        return None


class ToyDrive:
    """World, costmaps, planner, controller, navigation and safety, stepped together.

    Attributes:
        health: of the localisation, as the estimate says it.
        obscured, rivals: of the estimate.
        follow_changes: whether the costmaps see what changes in the world.
    """

    def __init__(
        self, world: ToyWorld, *, planner=None, follower=None, progress=None, globe=None,
        is_real_time=False, estimator=None, cover=lambda _: None, interlock=None,
        **settings,
    ) -> None:  # fmt: skip
        self.world, self.health, self.follow_changes = world, 0.9, True
        self.obscured, self.rivals = False, ()
        self.tracks = list  # returns the moving objects now
        self.evaded = list  # returns those of them that only evasion keeps clear of
        self.standing = list  # returns what is not on the map and has not moved
        self.events: list[tuple[str, str, dict]] = []
        self.planner = planner or ToyPlanner()
        self.local, self.globe = ToyCostmap(world), globe or ToyCostmap(world)
        self.follower = follower or PathFollower(
            PurePursuit, PurePursuitParameters(), world.robot, world.period
        )
        self.progress_checker = progress or PoseProgressChecker(
            PoseProgressParameters(), world.robot
        )
        self.estimator = estimator or Belief(self)
        self.now = CurrentStep(Perceived(world.time, self.estimator.estimate))
        tools = DriveTools(
            world.robot, self.follower, StoppedGoalChecker(StoppedGoalParameters(), world.robot),
            self.progress_checker,
            PlannerWorker(self.planner, lambda _: None, is_real_time=is_real_time),
            replace(NavigationParameters(), **settings), self.local, self.globe, self.emit,
            world.period,
        )  # fmt: skip
        evasion = Evasion(world.robot, EvasionParameters())
        self.navigator = Navigator(
            tools,
            evasion,
            self.estimator,
            self.now,
            cover,
            log=lambda _: None,
            interlock=interlock or FreeToDrive(),
        )
        self.safety = SafetyStage(world.robot, SafetyParameters(), world.period)
        self.commands, self.distance = [], 0.0

    def emit(self, kind, text, level="info", **fields):
        self.events.append((kind, text, fields))

    def kinds(self) -> list[str]:
        return [kind for kind, _, _ in self.events]

    def step(self) -> None:
        world = self.world
        if self.follow_changes:
            self.local.update()
            self.globe.update()
        around = WorldView(
            tuple(self.tracks()), standing=tuple(self.standing()), evaded=tuple(self.evaded())
        )
        state = Perceived(
            world.time, self.estimator.estimate, world.odometry, world.obstacles, world=around
        )
        self.now.see(state)
        twist, before = self.navigator.step(state).twist, world.pose
        self.commands.append(twist)
        world.drive(self.safety.limit(twist, world.odometry, world.obstacles))
        self.distance += before.distance_to(world.pose)

    def run(self, seconds: float, until=lambda: False) -> float:
        """Step until something holds or time is over; the time it took."""
        begin = self.world.time
        while self.world.time - begin < seconds - 1e-9 and not until():
            self.step()
        return self.world.time - begin

    def finish(self, task, seconds: float = 60.0):
        """Step until a task is over; its status."""
        self.run(seconds, lambda: not task.running)
        return task.status
