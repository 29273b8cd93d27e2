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

from collections.abc import Sequence
from dataclasses import replace

from stack.body import (
    HEALTHY,
    LINK,
    BlockPose,
    Body,
    BodyCommand,
    BodyHealth,
    ContactTally,
    DisturbedWorld,
    GroundTruth,
    SimulatedWorld,
    SimulationEvent,
)
from stack.drivetrain.description import CAMERA, RobotDescription
from stack.sim.disturbances import disturb
from stack.sim.faults.planned import PlannedFault
from stack.sim.faults.schedule import FaultSchedule
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import World
from stack.types import Disturbance, FloatArray, Observation, Pose2D


class SimulatedBody(Body, SimulatedWorld, DisturbedWorld):
    """Robot with base, arm, sensors and battery in PyBullet.

    Several robots share a world if each is made with the same `simulation`. Time then passes for
    all of them at once: `wait` returns, but time advances when every robot has called it.

    Args:
        description: the robot.
        world: the world it drives in.
        start: pose of the base frame, world frame.
        seed: of every random stream.
        simulation: of this world, shared with other robots; None: one of its own.
        faults: of this robot, and of its world.

    Raises:
        BodyError: the robot's URDF cannot be read.
    """

    def __init__(  # noqa: PLR0913 - the optional ones by keyword
        self, description: RobotDescription, world: World, *, start: Pose2D, seed: int,
        simulation: Simulation | None = None, faults: Sequence[PlannedFault] = (),
    ) -> None:  # fmt: skip
        self._simulation, self._owns_it = simulation or Simulation(world), not simulation
        try:
            self._robot = self._simulation.add_robot(description, start, seed)
        except BaseException:
            if simulation is None:
                self._simulation.close()
            raise
        self._faults = FaultSchedule(faults, self._simulation, self._robot)

    def reset(self, seed: int, faults: Sequence[PlannedFault] = ()) -> None:
        """Begin the next run, as `Simulation.reset` does, with these faults."""
        self._simulation.reset(seed)
        self._faults.restart(faults)

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._robot.description

    @property
    def time(self) -> float:
        """Simulated seconds since the run began."""
        return self._simulation.time

    def sense(self) -> Observation:
        """Return the measurements since the last call: newest scan and picture, all IMU samples."""
        self._simulation.begin()
        self._faults.update()
        return self._faults.applied(self._robot.observation(self.time))

    def command(self, command: BodyCommand) -> None:
        """Command a velocity; `wait` applies ramps, limits and the dead-man stop.

        Pictures are exposed now if the camera's rate allows, and delivered `latency` later.
        """
        if self._robot.link:
            return
        self._robot.drive.command(command.twist, command.emergency_stop)
        if self._robot.arm is not None:
            self._robot.arm.command(command)
        for name, camera in self._robot.cameras.items():
            wanted = command.capture if name == CAMERA else command.depth
            if wanted and camera.is_ready(self.time):
                request = self._simulation.render_request(self._robot)
                described, actual = self._robot.camera_now(name)
                camera.expose(self.time, replace(request, camera=actual), described)

    @property
    def health(self) -> BodyHealth:
        """Healthy, unless a fault of the link is noticed."""
        if self._robot.link != "noticed":
            return HEALTHY
        return BodyHealth("it does not get commands", LINK)

    def wait(self, period: float) -> None:
        """Advance the simulation by `period` seconds, at the set pace.

        The pace is kept before the physics: by `rest`, or else by the next `wait`.

        Raises:
            ParameterError: the period is not a multiple of the physics period.
        """
        self._simulation.wait(self._robot, period)

    def close(self) -> None:
        """Leave the simulation; close it unless it was given. Safe to call twice."""
        self._simulation.remove(self._robot)
        if self._owns_it:
            self._simulation.close()

    def rest(self, longest: float) -> bool:
        """Sleep at most `longest` wall seconds until the pace and the camera allow a step."""
        rested = self._simulation.pace.rest(longest)
        return rested and all(
            camera.await_picture(self.time, longest) for camera in self._robot.cameras.values()
        )

    @property
    def is_due(self) -> bool:
        """Whether the time of the last `wait` has passed; always, for a robot alone."""
        return self._simulation.is_due(self._robot)

    def freeze(self, wanted: bool) -> bool:
        """Ask for time to stand, or to go on; return whether it stands: all robots ask for it."""
        return self._simulation.freeze(self._robot, wanted)

    @property
    def truth(self) -> GroundTruth:
        """Exact pose and velocity of the base frame."""
        return self._robot.truth

    @property
    def tally(self) -> ContactTally:
        """Contacts so far."""
        return self._robot.tally

    @property
    def clearance(self) -> float:
        """Smallest distance so far between the robot and an obstacle, metres; at most 1 m."""
        return self._robot.clearance

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people who are there, world frame, metres."""
        return self._simulation.people.places

    @property
    def all_people(self) -> FloatArray:
        """(n, 3) as `people`, of everyone in the order of the world; nan: not there."""
        return self._simulation.people.all_places

    @property
    def doors(self) -> dict[str, bool]:
        """Doors: name -> closed."""
        return dict(self._simulation.doors)

    @property
    def scene_changes(self) -> int:
        """Number of door movements so far."""
        return self._simulation.scene_changes

    def take_events(self) -> list[SimulationEvent]:
        """Return the events of the world since the last call, each (kind, sentence)."""
        return self._robot.take_events()

    @property
    def blocks(self) -> list[BlockPose]:
        """Where the blocks of the world are, in its order."""
        return self._simulation.blocks

    def disturb(self, disturbance: Disturbance) -> None:
        """Drop a box, move a door, push or lift the robot, silence a sensor, set the charge."""
        disturb(self._simulation, self._robot, disturbance)

    def take_settings(self) -> dict[str, float | None]:
        """Return the live parameters that faults of this step set; None: back to the run's own."""
        return self._faults.take_settings()

    @property
    def pace(self) -> float:
        """Simulated seconds per wall second; 0: as fast as possible."""
        return self._simulation.pace.factor

    @pace.setter
    def pace(self, factor: float) -> None:
        self._simulation.pace.factor = factor

    @property
    def slept(self) -> float:
        """Wall seconds slept so far to keep the pace."""
        return self._simulation.pace.slept
