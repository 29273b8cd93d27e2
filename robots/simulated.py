"""Simulated robot: the Body that missions use without hardware.

    body = SimulatedBody(description, world, start=Pose2D(0.0, 0.0), seed=7)
    while body.time < 10.0:
        observation = body.sense()
        body.command(BodyCommand(Twist(0.3)))
        body.wait(0.05)
    body.close()

The same description, world, start, seed and commands give bit-identical results, at any pace and
with any subset of sensors in use.
"""

from __future__ import annotations

import time as wall_clock

from stack.body import Body, BodyCommand, ContactTally, GroundTruth, SimulatedWorld
from stack.drivetrain.description import RobotDescription
from stack.sim.physics.settings import SimulationSettings
from stack.sim.sensors.camera import Camera
from stack.sim.sensors.rendering import RenderSetup
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import World
from stack.types import FloatArray, Observation, Pose2D

MAX_DELAY = 0.25
"""Delay behind schedule, wall seconds, above which the schedule restarts from now."""


class SimulatedBody(Body, SimulatedWorld):
    """Wheeled robot with lidar, odometry, IMU, camera and battery in PyBullet.

    Args:
        description: the robot.
        world: the world it drives in.
        start: pose of the base frame, world frame.
        seed: of every random stream.
        settings: rates and pace.

    Raises:
        BodyError: the robot's URDF cannot be read.
        ParameterError: a sensor's period is not a multiple of the physics period.
    """

    def __init__(
        self, description: RobotDescription, world: World, *, start: Pose2D, seed: int,
        settings: SimulationSettings = SimulationSettings(),  # noqa: B008 - frozen
    ) -> None:  # fmt: skip
        self._description = description
        self._pace, self._slept = settings.pace, 0.0
        self._settings, self._closed = settings, False
        self._camera: Camera | None = None
        if description.camera is not None:
            self._camera = Camera(RenderSetup(world, description.urdf, description.camera, seed))
        self._simulation = Simulation(description, world, start, seed, settings)
        self._schedule: tuple[float, float] | None = None

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Simulated seconds since the run began."""
        return self._simulation.time

    def sense(self) -> Observation:
        """Return the measurements since the last call: newest scan and picture, all IMU samples."""
        image = self._camera.take(self.time) if self._camera else None
        return self._simulation.observation(image)

    def command(self, command: BodyCommand) -> None:
        """Command a velocity; `wait` applies ramps, limits and the dead-man stop.

        Pictures are exposed now if the camera's rate allows, and delivered `latency` later.
        """
        self._simulation.drive.command(command.twist)
        camera = self._camera
        if command.capture and camera is not None and camera.is_ready(self.time):
            camera.expose(self.time, self._simulation.render_request())

    def wait(self, period: float) -> None:
        """Advance the simulation by `period` seconds, at the set pace.

        Raises:
            ParameterError: the period is not a multiple of the physics period.
        """
        self._simulation.advance(self._settings.steps("control period", period))
        if self._pace > 0.0:
            self._keep_pace(period / self._pace)
        else:
            self._schedule = None

    def close(self) -> None:
        """Close physics and renderer. Safe to call twice."""
        if not self._closed:
            self._closed = True
            self._simulation.close()
            if self._camera is not None:
                self._camera.close()

    @property
    def truth(self) -> GroundTruth:
        """Exact pose and velocity of the base frame."""
        return self._simulation.truth

    @property
    def tally(self) -> ContactTally:
        """Contacts so far."""
        return self._simulation.tally

    @property
    def clearance(self) -> float:
        """Smallest distance so far between the robot and an obstacle, metres; at most 1 m."""
        return self._simulation.clearance

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people, world frame, metres."""
        return self._simulation.people.places

    @property
    def doors(self) -> dict[str, bool]:
        """Doors: name -> closed."""
        return dict(self._simulation.doors)

    @property
    def scene_changes(self) -> int:
        """Number of door movements so far."""
        return self._simulation.scene_changes

    def take_events(self) -> list[tuple[str, str]]:
        """Return the events of the world since the last call, each (kind, sentence)."""
        return self._simulation.take_events()

    @property
    def pace(self) -> float:
        """Simulated seconds per wall second; 0: as fast as possible."""
        return self._pace

    @pace.setter
    def pace(self, factor: float) -> None:
        self._pace = factor

    @property
    def slept(self) -> float:
        """Wall seconds slept so far to keep the pace."""
        return self._slept

    def _keep_pace(self, seconds: float) -> None:
        """Sleep until the period is over on the wall clock; does not affect the simulation."""
        now = wall_clock.monotonic()  # noqa: TID251 - pacing inside a body's wait
        due, pace = self._schedule or (now, self._pace)
        if pace != self._pace or now - due > MAX_DELAY:
            due = now
        due += seconds
        self._schedule = (due, self._pace)
        if due > now:
            self._slept += due - now
            wall_clock.sleep(due - now)  # noqa: TID251 - pacing inside a body's wait
