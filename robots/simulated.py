"""A robot in a simulated world: the Body that missions run on without hardware.

    body = SimulatedBody(description, world, start=Pose2D(0.0, 0.0), seed=7)
    while body.time < 10.0:
        observation = body.sense()
        body.drive(Twist(0.3))
        body.wait(0.05)
    body.close()

Same description, world, start, seed and commands: the same bits, at any pace, whatever sensors
are listened to. Beyond Body there is what only a simulation knows, for scoring and for screens.
"""

from __future__ import annotations

import time as wall_clock

from stack.drivetrain.description import RobotDescription
from stack.sim.physics.contacts import ContactTally
from stack.sim.physics.physics_world import GroundTruth
from stack.sim.physics.settings import SimulationSettings
from stack.sim.sensors.camera import Camera
from stack.sim.sensors.rendering import RenderSetup
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import World
from stack.types import FloatArray, Observation, Pose2D, Twist

PATIENCE = 0.25
"""Wall seconds behind schedule after which the lost time is forgotten."""


class SimulatedBody:
    """A wheeled robot with lidar, odometry, IMU, camera and battery in PyBullet.

    Args:
        description: the robot.
        world: where it drives.
        start: of the base frame, world frame.
        seed: of every random stream.
        settings: rates and pace.

    Raises:
        BodyError: the robot's shape cannot be read.
        ParameterError: a sensor's period is not a multiple of the physics period.
    """

    def __init__(
        self, description: RobotDescription, world: World, *, start: Pose2D, seed: int,
        settings: SimulationSettings = SimulationSettings(),  # noqa: B008 - frozen
    ) -> None:  # fmt: skip
        self.description = description
        self.pace = settings.pace
        self.slept = 0.0
        self._settings, self._closed = settings, False
        self._camera: Camera | None = None
        if description.camera is not None:
            self._camera = Camera(RenderSetup(world, description.urdf, description.camera, seed))
        self._simulation = Simulation(description, world, start, seed, settings)
        self._schedule: tuple[float, float] | None = None

    @property
    def time(self) -> float:
        """Simulated seconds since the run began."""
        return self._simulation.time

    def sense(self) -> Observation:
        """What came in since the last call; the newest scan and picture, all IMU samples."""
        image = self._camera.take(self.time) if self._camera else None
        return self._simulation.observation(image)

    def drive(self, twist: Twist) -> None:
        """Command a velocity; ramps, limits and the dead-man stop follow in `wait`."""
        self._simulation.drive.command(twist)

    def ask_for_image(self) -> None:
        """Expose a picture now if the camera's rate allows; it arrives `latency` later."""
        if self._camera is not None and self._camera.is_ready(self.time):
            self._camera.expose(self.time, self._simulation.render_request())

    def wait(self, period: float) -> None:
        """Step the physics through a period, and keep pace with the wall clock if one is set.

        Raises:
            ParameterError: the period is not a multiple of the physics period.
        """
        self._simulation.advance(self._settings.steps("control period", period))
        if self.pace > 0.0:
            self._keep_pace(period / self.pace)
        else:
            self._schedule = None

    def close(self) -> None:
        """Let go of physics and renderer. Safe to call twice."""
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
        """Smallest distance so far between the robot and anything but the floor; at most 1 m."""
        return self._simulation.clearance

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of everybody, metres."""
        return self._simulation.people.places

    @property
    def doors(self) -> dict[str, bool]:
        """Which doors are closed, by name."""
        return dict(self._simulation.doors)

    @property
    def scene_changes(self) -> int:
        """Grows when a door moves."""
        return self._simulation.scene_changes

    def news(self) -> list[tuple[str, str]]:
        """What happened since the last call: (kind, sentence), for the event log."""
        return self._simulation.take_news()

    def _keep_pace(self, seconds: float) -> None:
        """Sleep until this period is over on the wall clock. The simulation knows nothing of it."""
        now = wall_clock.monotonic()  # noqa: TID251 - pacing inside a body's wait
        due, pace = self._schedule or (now, self.pace)
        if pace != self.pace or now - due > PATIENCE:
            due = now
        due += seconds
        self._schedule = (due, self.pace)
        if due > now:
            self.slept += due - now
            wall_clock.sleep(due - now)  # noqa: TID251 - pacing inside a body's wait
