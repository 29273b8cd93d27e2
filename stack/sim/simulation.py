"""Simulation of one robot, its sensors and its world, advanced in physics steps."""

from __future__ import annotations

from collections import deque

from stack.body import ContactTally, GroundTruth
from stack.drivetrain.description import RobotDescription
from stack.sim.battery import Battery
from stack.sim.people import People
from stack.sim.physics.contacts import ContactCounter
from stack.sim.physics.friction import FrictionZones
from stack.sim.physics.physics_world import Physics
from stack.sim.physics.settings import SimulationSettings
from stack.sim.sensors.imu import Imu
from stack.sim.sensors.lidar import Lidar
from stack.sim.sensors.odometry import Encoders, Odometry
from stack.sim.sensors.rendering import RenderRequest
from stack.sim.sensors.sonar import Sonar
from stack.sim.skidding import wheel_motion_of
from stack.sim.timeline import Timeline
from stack.sim.wheel_controller import WheelController
from stack.sim.worlds.world import World, WorldEvent
from stack.types import Image, Measurement, Observation, Pose2D

CLEARANCE_REACH = 1.0
"""Largest clearance that is measured, metres."""

NEVER = 1 << 62
"""Period, in steps, of a sensor that the robot does not have."""


class Simulation:
    """One robot in one world. The clock counts physics steps.

    Physics and wheel controller run in every step; people, encoders, battery and contacts at the
    scene rate; each sensor at its own rate. The timeline is evaluated after each `advance`.
    """

    def __init__(
        self, description: RobotDescription, world: World, start: Pose2D, seed: int,
        settings: SimulationSettings,
    ) -> None:  # fmt: skip
        self._step = 0
        self._period = 1.0 / settings.physics_rate
        self._plan_rates(description, settings)
        self.doors = {door.name: door.closed for door in world.doors}
        self.scene_changes, self.clearance = 0, CLEARANCE_REACH
        self._events: list[tuple[str, str]] = []

        self.drive = WheelController(description.drivetrain, self._period)
        self._odometry = Odometry(description, seed)
        self._lidars = {
            name: Lidar(lidar, world, seed, "lidar" if name == "lidar" else f"lidar:{name}")
            for name, lidar in description.all_lidars.items()
        }
        self._sonars = {
            name: Sonar(sonar, world, seed, name) for name, sonar in description.sonars.items()
        }
        self._measured: dict[str, Measurement] = {}
        longest = max((lidar.rotation_time for lidar in self._lidars.values()), default=0.0)
        self._trail: deque[tuple[float, Pose2D]] = deque(
            maxlen=int(longest * settings.scene_rate) + 3 if longest > 0.0 else 0
        )
        self._imu = Imu(description.imu, seed) if description.imu else None
        self._battery = Battery(
            description.battery, description.limits, world.docks, settings.battery_charge
        )
        self.people = People(world.people, description.footprint.circumscribed_radius)
        self._contacts = ContactCounter()
        self._timeline = Timeline(world.timeline)
        self._physics = Physics(description, world, start, settings)
        self._friction = FrictionZones(world, self._physics)
        self._wheel_motion = wheel_motion_of(description, self._physics, seed)
        self._begin()

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._step * self._period

    @property
    def truth(self) -> GroundTruth:
        """Exact pose and velocity of the robot."""
        return self._physics.truth()

    @property
    def tally(self) -> ContactTally:
        """Contacts so far."""
        return self._contacts.tally

    def advance(self, steps: int) -> None:
        """Run this many physics steps."""
        physics, drive = self._physics, self.drive
        for _ in range(steps):
            if drive.advance():
                self._set_wheels()
            physics.step()
            self._step += 1
            if self._step % self._scene_steps == 0:
                self._update_scene(self._scene_steps * self._period)
            if self._step % self._imu_steps == 0:
                self._read_imu()
            self._read_range_sensors()
            if self._step % self._clearance_steps == 0:
                self._measure_clearance()
        self._apply_due_events()

    def observation(self, image: Image | None) -> Observation:
        """Return the measurements since the last call."""
        measurements, self._measured = self._measured, {}
        measurements["wheels"] = self._odometry.reading
        measurements["battery"] = self._battery.reading(self.time)
        samples = self._imu.take() if self._imu else None
        if samples is not None:
            measurements["imu"] = samples
        if image is not None:
            measurements["camera"] = image
        return Observation(self.time, measurements)

    def render_request(self) -> RenderRequest:
        """Return the state that a camera renders: robot, people and doors as of now."""
        position, orientation = self._physics.base_pose()
        return RenderRequest(
            self._step, position, orientation, self.people.places, dict(self.doors)
        )

    def take_events(self) -> list[tuple[str, str]]:
        """Return the events since the last call, each (kind, sentence)."""
        events, self._events = self._events, []
        return events

    def close(self) -> None:
        """Disconnect from the physics engine. Safe to call twice."""
        self._physics.close()

    def _plan_rates(self, description: RobotDescription, settings: SimulationSettings) -> None:
        self._scene_steps = settings.steps("scene period", 1.0 / settings.scene_rate)
        self._clearance_steps = settings.steps("clearance period", 1.0 / settings.clearance_rate)
        self._imu_steps = NEVER
        rates = {name: lidar.rate for name, lidar in description.all_lidars.items()}
        rates |= {name: sonar.rate for name, sonar in description.sonars.items()}
        self._range_sensor_steps = {
            name: settings.steps(f"{name} period", 1.0 / rate) for name, rate in rates.items()
        }
        if description.imu:
            self._imu_steps = settings.steps("IMU period", 1.0 / description.imu.rate)

    def _begin(self) -> None:
        self._physics.scene.place_people(self.people.places)
        self._friction.update(self.truth.pose)
        self._odometry.update(0.0, self._encoders())
        self._apply_due_events()
        self._trail.append((0.0, self.truth.pose))
        for name in self._range_sensor_steps:
            self._measure(name)
        self._measure_clearance()

    def _set_wheels(self) -> None:
        wheels = self.drive.wheels
        self._physics.set_wheel_speeds(*self._wheel_motion.motor_speeds(wheels.speeds))
        self._physics.steer(wheels.steering)

    def _update_scene(self, period: float) -> None:
        truth = self._physics.truth()
        if self.people.walk(period, truth.pose):
            self._physics.scene.place_people(self.people.places)
        self._odometry.update(self.time, self._encoders())
        self._battery.update(truth, period)
        self._friction.update(truth.pose)
        self._trail.append((self.time, truth.pose))
        if self._wheel_motion.update(self._friction.floor_at(truth.pose.x, truth.pose.y)):
            self._set_wheels()
        self._count_contacts(truth)

    def _encoders(self) -> Encoders:
        wheels = self._wheel_motion.encoder_angles(self._physics.wheel_angles())
        return Encoders(wheels, self._physics.steering_angles())

    def _count_contacts(self, truth: GroundTruth) -> None:
        touching = self._physics.touching()
        if self._contacts.update(self.time, bool(touching), truth.twist):
            body, x, y = touching[0]
            obstacle = self._physics.scene.obstacles[body]
            self._report("contact", f"contact with {obstacle} at ({x:.2f}, {y:.2f})")

    def _read_imu(self) -> None:
        assert self._imu is not None
        self._imu.sample(self.time, self._physics.base_state())

    def _read_range_sensors(self) -> None:
        """Read lidars and sonars, each at its own rate."""
        for name, steps in self._range_sensor_steps.items():
            if self._step % steps == 0:
                self._measure(name)

    def _measure(self, name: str) -> None:
        truth, people = self.truth.pose, self.people.places
        if name not in self._lidars:
            self._measured[name] = self._sonars[name].reading(
                truth, people, self.doors, self._step, self.time
            )
            return
        lidar = self._lidars[name]
        trail = [(0.0, truth)]
        if lidar.rotation_time > 0.0:
            self._trail.append((self.time, truth))
            trail = list(self._trail)
            if trail[0][0] > self.time - lidar.rotation_time:
                return  # the first turn is not complete
        self._measured[name] = lidar.scan(trail, people, self.doors, self._step, self.time)

    def _measure_clearance(self) -> None:
        self.clearance = self._physics.distance(self.clearance)

    def _apply_due_events(self) -> None:
        for event in self._timeline.due(self.time, self.truth.pose):
            self._apply(event)

    def _apply(self, event: WorldEvent) -> None:
        if event.open_door is not None:
            self._move_door(event.open_door, closed=False)
        if event.close_door is not None:
            self._move_door(event.close_door, closed=True)
        if event.move_robot is not None:
            self._lift_robot(event.move_robot)
        if event.battery is not None:
            self._battery.charge = event.battery
            self._report("battery", f"battery charge set to {event.battery:.0%}")

    def _move_door(self, name: str, *, closed: bool) -> None:
        self._physics.scene.place_door(name, closed)
        self.doors[name] = closed
        self.scene_changes += 1
        self._report("door", f"the door {name} {'closed' if closed else 'opened'}")

    def _lift_robot(self, pose: Pose2D) -> None:
        self.drive.halt()
        self._physics.place_robot(pose)
        self._trail.clear()
        self._friction.update(pose)
        if self._imu:
            self._imu.reset_velocity()
        where = f"({pose.x:.2f}, {pose.y:.2f}, {pose.heading:.2f})"
        self._report("lifted", f"the robot was lifted to {where}")

    def _report(self, kind: str, text: str) -> None:
        self._events.append((kind, text))
