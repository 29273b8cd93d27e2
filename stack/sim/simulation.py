"""Simulation of a world and the robots in it, advanced in physics steps."""

from __future__ import annotations

from dataclasses import replace
from math import dist

import numpy as np

from stack.body import BlockPose
from stack.drivetrain.description import RobotDescription
from stack.sim.pace import Pace
from stack.sim.people import People
from stack.sim.physics.default import DEFAULT_ENGINE
from stack.sim.physics.engine import PhysicsEngine
from stack.sim.rates import PHYSICS_PERIOD, SCENE_RATE, physics_steps
from stack.sim.scene_state import RobotShape, SceneState
from stack.sim.sensors.requests import RenderRequest
from stack.sim.simulated_robot import SimulatedRobot
from stack.sim.timeline import Timeline
from stack.sim.worlds.world import World, WorldEvent
from stack.types import FloatArray, Pose2D

VISIBLE_MOTION = 0.005
"""Metres that a block has moved when displays draw it again."""

SCENE_STEPS = physics_steps("scene period", 1.0 / SCENE_RATE)


class Simulation:
    """A world with one or several robots. The clock counts physics steps.

    Physics and wheel controllers run in every step; people, encoders, batteries and contacts at the
    scene rate; each sensor at its own rate. The timeline is evaluated after each advance.

    All robots have one clock: time advances once each of them has called `wait`, up to the earliest
    of their times.

    Args:
        world: the world file's content.
        engine: of the physics.
        pace: simulated seconds per wall second; 0: as fast as possible.

    Attributes:
        world: as given.
        pace: of the clock.
        doors: name -> closed.
        scene_changes: number of visible movements of doors and blocks so far.
        boxes: dropped while the simulation runs. Range sensors see them, cameras do not.
    """

    def __init__(
        self, world: World, engine: type[PhysicsEngine] = DEFAULT_ENGINE, pace: float = 0.0
    ) -> None:
        self.world = world
        self._engine = engine(world)
        self._robots: list[SimulatedRobot] = []
        self._begin_again(pace)

    def _begin_again(self, pace: float) -> None:
        self.pace, self._step, self._has_begun = Pace(pace), 0, False
        self.doors = {door.name: door.closed for door in self.world.doors}
        self.scene_changes = 0
        self.boxes: list[RobotShape] = []
        self._shown_blocks: list[BlockPose] = []
        self.people = People(replace(self.world, people=()), 0)  # until all robots are known
        self._timeline = Timeline(self.world.timeline)
        self._active = list(self._robots)

    def reset(self, seed: int) -> None:
        """Begin the next run, bit for bit as a new simulation with the same robots would.

        The robots are at their starts again. The first one has the seed, the second one `seed + 1`,
        and so on. The shapes of the world and of the robots, and the cameras' processes, are kept,
        and the pace.
        """
        self._engine.reset()
        self._begin_again(self.pace.factor)
        for number, robot in enumerate(self._robots):
            robot.restart(seed + number)

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._step * PHYSICS_PERIOD

    def add_robot(self, description: RobotDescription, start: Pose2D, seed: int) -> SimulatedRobot:
        """Add a robot before the first step.

        Raises:
            BodyError: its URDF cannot be read.
        """
        assert not self._has_begun
        robot = SimulatedRobot(description, self.world, self._engine, start=start, seed=seed)
        self._robots.append(robot)
        self._active.append(robot)
        return robot

    def begin(self) -> None:
        """Take the first measurements, once all robots are in the world. Safe to call twice."""
        if self._has_begun:
            return
        self._has_begun = True
        places = [(robot.truth.pose, robot.radius) for robot in self._robots]
        self.people = People(self.world, self._robots[0].seed, places)
        self._engine.place_people(self.people.positions)
        self._apply_due_events()
        for robot in self._robots:
            robot.begin(self.scene_around(robot))

    def wait(self, robot: SimulatedRobot, period: float) -> None:
        """Let `period` seconds pass for a robot; time advances once every robot waits.

        It first sleeps what is left of the wall time of the period before.

        Raises:
            ParameterError: the period is not a multiple of the physics period.
        """
        robot.due = self._step + physics_steps("control period", period)
        self._advance_to_due()

    def is_due(self, robot: SimulatedRobot) -> bool:
        """Whether the time for which a robot waited is over."""
        return robot.due <= self._step

    def freeze(self, robot: SimulatedRobot, wanted: bool) -> bool:
        """Ask for time to stand, or to go on; return whether it stands: all robots ask for it."""
        robot.wants_freeze = wanted
        return all(other.wants_freeze and self.is_due(other) for other in self._active)

    def remove(self, robot: SimulatedRobot) -> None:
        """Wait for a robot no longer; it stays in the world, and its dead-man stops it.

        Safe to call twice.
        """
        if robot not in self._active:
            return
        self._active.remove(robot)
        if self._active:
            self._advance_to_due()

    def close(self) -> None:
        """Close the physics engine and the cameras. Safe to call twice."""
        self._active.clear()
        self._engine.close()
        for robot in self._robots:
            for camera in robot.cameras.values():
                camera.close()

    def scene_around(self, robot: SimulatedRobot) -> SceneState:
        """Return what a robot's sensors can see besides the static parts of the world."""
        others = [other.shape for other in self._robots if other is not robot]
        return SceneState(self.people.places, self.doors, (*others, *self.boxes))

    def movers(self, but: SimulatedRobot | None = None) -> FloatArray:
        """Return x, y and radius (n, 3) of people and robots, except one: world frame, metres."""
        others = [
            (other.truth.pose.x, other.truth.pose.y, other.radius)
            for other in self._robots
            if other is not but
        ]
        return np.vstack([self.people.places, np.reshape(others, (-1, 3))])

    @property
    def robots(self) -> tuple[SimulatedRobot, ...]:
        """The robots in the world."""
        return tuple(self._robots)

    def drop(self, box: RobotShape, size: tuple[float, float, float]) -> None:
        """Put a box of a size (length, width, height), metres, onto the floor."""
        self._engine.drop_box(box.pose, size)
        self.boxes.append(box)
        where = f"({box.pose.x:.2f}, {box.pose.y:.2f})"
        for robot in self._robots:
            robot.report("box", f"a box was dropped at {where}", at=[box.pose.x, box.pose.y])

    def render_request(self, robot: SimulatedRobot) -> RenderRequest:
        """Return the state that a robot's camera renders: everything that moves, as of now."""
        state = robot.physics.base_state()
        others = tuple(
            (other.description.model, *other.physics.base_state()[:2])
            for other in self._robots
            if other is not robot
        )
        return RenderRequest(
            self._step, state.position, state.orientation, self.people.all_places,
            dict(self.doors), others, state.velocity, state.spin, robot.seed,
            tuple(self._engine.blocks()), robot.joint_positions,
        )  # fmt: skip

    @property
    def blocks(self) -> list[BlockPose]:
        """Where the blocks of the world are, in its order."""
        return self._engine.blocks()

    def _advance_to_due(self) -> None:
        steps = min(robot.due for robot in self._active) - self._step
        if steps <= 0:
            return
        self.pace.rest()
        self.begin()
        end = self._step + steps
        while self._step < end:
            due = self._due_step
            self._run_physics(min(end, due))
            if self._step == due:
                self._measure()
        self._apply_due_events()
        self.pace.advance(steps * PHYSICS_PERIOD)

    @property
    def _due_step(self) -> int:
        """The next physics step in which the scene or a sensor is due."""
        scene = self._step - self._step % SCENE_STEPS + SCENE_STEPS
        return min(scene, *[robot.due_step for robot in self._robots])

    def _run_physics(self, until: int) -> None:
        """Advance physics and wheel controllers to a step."""
        steps = until - self._step
        pushed = [robot for robot in self._robots if robot.is_pushed]
        changing = [robot for robot in self._robots if not robot.drive.skip(steps)]
        arms = [robot.arm for robot in self._robots if robot.arm and robot.arm.is_moving]
        if changing or pushed or arms:
            for _ in range(steps):
                for arm in arms:
                    arm.advance()
                for robot in changing:
                    robot.drive_wheels()
                for robot in pushed:
                    robot.advance_push(PHYSICS_PERIOD)
                self._engine.step()
        else:
            self._engine.step(steps)
        self._step = until

    def _measure(self) -> None:
        """Update everything that is due in this step besides the physics."""
        step, time = self._step, self.time
        if step % SCENE_STEPS == 0:
            self._update_scene()
        for robot in self._robots:
            robot.measure_inertia(step, time)
            if robot.measures_ranges(step):
                robot.measure_ranges(step, time, self.scene_around(robot))
            robot.measure_clearance(step)

    def _update_scene(self) -> None:
        period = SCENE_STEPS * PHYSICS_PERIOD
        truths = [robot.truth for robot in self._robots]
        places = [
            (truth.pose, robot.radius) for robot, truth in zip(self._robots, truths, strict=True)
        ]
        if self.world.blocks:
            self._follow_blocks()
        touched: dict[str, float] = {}
        for robot in self._robots:
            for name, depth in robot.touched.items():
                touched[name] = max(depth, touched.get(name, 0.0))
        if self.people.walk(period, places, self.doors, touched):
            self._engine.place_people(self.people.positions)
        for robot, truth in zip(self._robots, truths, strict=True):
            robot.update_scene(self.time, period, truth)

    def _follow_blocks(self) -> None:
        """Count a change of the scene when a block has moved visibly."""
        blocks = self.blocks
        known = self._shown_blocks or blocks
        moved = (dist(now[0], then[0]) for now, then in zip(blocks, known, strict=True))
        if not self._shown_blocks or max(moved) > VISIBLE_MOTION:
            self.scene_changes += bool(self._shown_blocks)
            self._shown_blocks = blocks

    def _apply_due_events(self) -> None:
        poses = [robot.truth.pose for robot in self._robots]
        for event, number in self._timeline.due(self.time, poses):
            self._apply(event, self._robots[number])

    def _apply(self, event: WorldEvent, robot: SimulatedRobot) -> None:
        if event.open_door is not None:
            self.move_door(event.open_door, closed=False)
        if event.close_door is not None:
            self.move_door(event.close_door, closed=True)
        if event.move_robot is not None:
            robot.lift(event.move_robot)
        if event.push is not None:
            robot.push(event.push)
        if event.battery is not None:
            robot.set_charge(event.battery)

    def move_door(self, name: str, *, closed: bool) -> None:
        """Open or close a door."""
        self._engine.place_door(name, closed)
        self.doors[name] = closed
        self.scene_changes += 1
        for robot in self._robots:
            done = "closed" if closed else "opened"
            robot.report("door", f"the door {name} {done}", door=name, closed=closed)
