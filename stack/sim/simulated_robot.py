"""One robot of a simulation: drive, sensors, battery and contacts."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from stack.body import ContactTally, GroundTruth, SimulationEvent
from stack.drivetrain.description import (
    BASE,
    CAMERA,
    CameraDescription,
    DepthCameraDescription,
    RobotDescription,
)
from stack.errors import InputError
from stack.frames.links import RobotLinks
from stack.sim.arm import SimulatedArm
from stack.sim.battery import Battery
from stack.sim.faulty_wheels import FaultyWheels
from stack.sim.physics.contacts import ContactCounter, depths, is_driving
from stack.sim.physics.engine import PhysicsEngine, PhysicsRobot, Touch
from stack.sim.physics.friction import FrictionZones
from stack.sim.pushes import PushMotion
from stack.sim.rates import CLEARANCE_RATE, PHYSICS_PERIOD, physics_schedule
from stack.sim.scene_state import RobotShape, SceneState
from stack.sim.sensors.camera import Camera
from stack.sim.sensors.imu import Imu
from stack.sim.sensors.lidar import Lidar
from stack.sim.sensors.odometry import Odometry
from stack.sim.sensors.requests import RenderSetup
from stack.sim.sensors.sonar import Sonar
from stack.sim.skidding import wheel_motion_of
from stack.sim.wheel_controller import WheelController
from stack.sim.worlds.world import Push, World
from stack.types import CameraModel, Measurement, Observation, Pose2D

CLEARANCE_REACH = 1.0
"""Largest clearance that is measured, metres."""


ROUNDING = 1e-9
"""Seconds by which two times that are meant to be the same may differ."""

PUSH_ENDS = 0.2
"""Seconds after a push in which contacts are still its own."""


class SimulatedRobot:
    """Drive, sensors, battery and contacts of one robot, each at its own rate.

    Args:
        description: the robot. Its `actual` one is simulated; commands, odometry and the mounts of
            measurements, cameras' too, are as described.
        world: in which it drives.
        engine: with that world.
        start: pose of the base frame, world frame.
        seed: of every random stream.

    Attributes:
        description: the robot.
        physics: the robot's bodies in the physics.
        cameras: of colours and of distances, by name.
        seed: of every random stream.
        drive: wheel controller; it takes the commands of the base.
        arm: takes the commands of the arm; None without one.
        clearance: smallest distance so far to an obstacle, metres; at most CLEARANCE_REACH.
        touched: by name, the depth by which the robot and what it touches overlap, metres.
        due: physics step up to which the robot lets time pass.
        wants_freeze: whether the robot asks for time to stand.
        radius: distance from the base to the farthest corner, metres.
        link: empty if commands arrive; `lost`: they do not; `noticed`: and the robot says so.
    """

    def __init__(
        self, description: RobotDescription, world: World, engine: PhysicsEngine, *,
        start: Pose2D, seed: int,
    ) -> None:  # fmt: skip
        self.description, self._world = description, world
        self._actual = description.actual or description
        self.radius = description.footprint.circumscribed_radius
        self._carrier = RobotShape(start, description.footprint, description.height)
        self._own = {
            name: engine.own_ranges(self._actual.model, lidar)
            for name, lidar in self._actual.real_lidars.items()
        }
        self.physics = engine.add_robot(self._actual, start)
        self.arm = _arm_of(description, self.physics)
        self._links = RobotLinks(description.links, BASE)
        self.cameras = {
            name: Camera(RenderSetup(world, description.model, camera, name), type(engine))
            for name, camera in _cameras(description).items()
        }
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Begin at time 0 with other random streams; the physics is at the start already."""
        description, world = self.description, self._world
        self.seed, self.due, self.wants_freeze = seed, 0, False
        self._plan_rates(description)
        self.clearance = CLEARANCE_REACH
        self._events: list[SimulationEvent] = []
        self.drive = WheelController(
            description.drivetrain, PHYSICS_PERIOD, description.wheel_control
        )
        self._odometry = Odometry(description, seed) if description.drivetrain.moves else None
        if self.arm is not None:
            self.arm.restart()
        self._lidars = {
            name: Lidar(
                lidar, world, seed, "lidar" if name == "lidar" else f"lidar:{name}",
                self._carrier, self._own[name],
            )
            for name, lidar in self._actual.real_lidars.items()
        }  # fmt: skip
        self._sonars = {
            name: Sonar(sonar, world, seed, name) for name, sonar in description.sonars.items()
        }
        self._measured: dict[str, Measurement] = {}
        self._longest_scan = max((lidar.duration for lidar in self._lidars.values()), default=0.0)
        self._trail: deque[tuple[float, Pose2D]] = deque()
        self._imu = Imu(description.imu, seed) if description.imu else None
        self._inertia_step = 0
        self._battery = Battery(description, world.docks)
        self._contacts, self._drops = ContactCounter(), world.drops
        self.touched: dict[str, float] = {}
        self._push: PushMotion | None = None
        self._pushed_at = -inf
        self._friction = FrictionZones(world, self.physics)
        self._wheel_motion = wheel_motion_of(self._actual, self.physics, seed)
        self._named: set[str] = set()
        self._silenced: set[str] = set()
        self.link = ""
        for camera in self.cameras.values():
            camera.restart()

    @property
    def truth(self) -> GroundTruth:
        """Exact pose and velocity."""
        return self.physics.truth()

    @property
    def shape(self) -> RobotShape:
        """The robot as the sensors of other robots see it."""
        return RobotShape(self.truth.pose, self.description.footprint, self.description.height)

    @property
    def tally(self) -> ContactTally:
        """Contacts so far."""
        return self._contacts.tally

    def begin(self, scene: SceneState) -> None:
        """Take the measurements of time 0."""
        truth = self.truth
        self._friction.update(truth.pose)
        self._read_encoders(0.0)
        self._follow(0.0, truth.pose)
        self.measure_ranges(0, 0.0, scene)
        self._imu_schedule.take(0)
        self.measure_clearance(0)

    def drive_wheels(self) -> None:
        """Apply the wheel controller's set point of the next physics step."""
        if self.drive.controls_torques:
            self._turn_wheels()
        elif self.drive.advance():
            self._set_wheels()

    def update_scene(self, time: float, period: float, truth: GroundTruth) -> None:
        """Update encoders, battery, friction and contacts; `period` is the time since the last."""
        self._read_encoders(time)
        self._battery.update(truth, period)
        self._friction.update(truth.pose)
        self._follow(time, truth.pose)
        if self._wheel_motion.update(self._friction.floor_at(truth.pose.x, truth.pose.y)):
            self._set_wheels()
        self._count_contacts(time, truth)

    @property
    def due_step(self) -> int:
        """Physics step in which the next sensor is due."""
        others = self._imu_schedule.due_step, self._clearance_schedule.due_step
        return min(self._ranges_due, *others)

    def measures_ranges(self, step: int) -> bool:
        """Whether a lidar or sonar measures in this physics step."""
        return step >= self._ranges_due

    def measure_ranges(self, step: int, time: float, scene: SceneState) -> None:
        """Read the lidars and sonars that are due, each at its own rate."""
        for name, schedule in self._range_schedules.items():
            if schedule.take(step):
                self._measure(name, scene, step, time)
        self._plan_ranges()

    def _plan_ranges(self) -> None:
        """Compute the physics step in which the next lidar or sonar is due."""
        steps = (schedule.due_step for schedule in self._range_schedules.values())
        self._ranges_due = min(steps, default=sys.maxsize)

    def measure_inertia(self, step: int, time: float) -> None:
        """Read the IMU if it is due."""
        if self._imu_schedule.take(step) and self._imu is not None:
            since, self._inertia_step = step - self._inertia_step, step
            self._imu.sample(time, self.physics.base_state(), since * PHYSICS_PERIOD)

    def measure_clearance(self, step: int) -> None:
        """Measure the distance to the nearest obstacle if it is due."""
        if self._clearance_schedule.take(step):
            self.clearance = self.physics.distance(self.clearance)

    def observation(self, time: float) -> Observation:
        """Return the measurements since the last call, and the pictures that are due."""
        pictures = {name: camera.take(time) for name, camera in self.cameras.items()}
        for camera in self.cameras.values():
            for problem in camera.take_problems():
                self.report("renderer", problem)
        taken = {name: picture for name, picture in pictures.items() if picture is not None}
        for name in taken:
            self._name_driver(name)
        measurements, self._measured = self._measured, {}
        if self._odometry is not None:
            measurements["wheels"] = self._odometry.reading
        measurements |= self._measured_joints(time)
        measurements["battery"] = self._battery.reading(time)
        samples = self._imu.take() if self._imu else None
        if samples is not None:
            measurements["imu"] = samples
        measured = {**measurements, **taken}
        return Observation(
            time, {name: item for name, item in measured.items() if name not in self._silenced}
        )

    def camera_now(self, name: str) -> tuple[CameraModel, CameraModel]:
        """Return a camera in the base frame now: as it is described, and as it is mounted."""
        described, actual = (_cameras(it)[name] for it in (self.description, self._actual))
        return self._mounted(described), self._mounted(actual)

    def _mounted(self, camera: CameraDescription | DepthCameraDescription) -> CameraModel:
        if not camera.link:
            return camera.model
        return camera.model.mounted_on(self._links.pose(camera.link, self.joint_positions))

    @property
    def joint_positions(self) -> dict[str, float]:
        """True positions of the joints of arm and gripper, by name; empty without an arm."""
        return {} if self.arm is None else self.arm.positions

    def _measured_joints(self, time: float) -> dict[str, Measurement]:
        """Return the state of the joints, and of the gripper; nothing without an arm."""
        if self.arm is None:
            return {}
        gripper = self.arm.gripper_state(time)
        joints: dict[str, Measurement] = {"joints": self.arm.state(time)}
        return joints if gripper is None else {**joints, "gripper": gripper}

    def silence(self, name: str, silent: bool) -> None:
        """Let a sensor deliver nothing from now on, or work again.

        Raises:
            InputError: there is no such sensor.
        """
        known = [*self._range_schedules, *self.cameras, *(["imu"] if self._imu else [])]
        if name not in known:
            raise InputError(f"there is no sensor {name!r}; available: {', '.join(known)}")
        (self._silenced.add if silent else self._silenced.discard)(name)
        words = "was taken away" if silent else "works again"
        self.report("sensor_silenced", f"the sensor {name} {words}", sensor=name, silent=silent)

    def _name_driver(self, name: str) -> None:
        """Report the driver of a camera's first picture: those of OpenGL differ between drivers."""
        driver = self.cameras[name].driver
        if driver and name not in self._named:
            self._named.add(name)
            self.report("renderer", f"{name}: pictures are drawn by OpenGL, {driver}")

    def set_charge(self, charge: float) -> None:
        """Set the battery charge, 0 to 1."""
        self._battery.charge = charge
        self.report("battery", f"battery charge set to {charge:.0%}")

    @property
    def is_pushed(self) -> bool:
        """Whether a push moves the body."""
        return self._push is not None

    def push(self, push: Push) -> None:
        """Begin to move the body; its wheels do not measure that. It replaces an earlier push."""
        self._push = PushMotion(push, self.physics)
        by = f"({push.by.x:.2f}, {push.by.y:.2f}, {push.by.heading:.2f})"
        self.report("pushed", f"a push of the robot by {by} in the {push.frame} frame begins")

    def advance_push(self, period: float) -> None:
        """Move the body on for one physics step of `period` seconds."""
        if self._push is None:
            return
        self._push.advance(period, self.drive.setpoint.twist)
        if self._push.is_over:
            moved, stopped = self._push.moved, self._push.is_blocked
            self._push = None
            if not any(self.drive.wheels.speeds):
                self._set_wheels()
            to = f"({moved.x:.2f}, {moved.y:.2f}, {moved.heading:.2f})"
            end = "was stopped by an obstacle" if stopped else "ended"
            self.report("pushed", f"the push {end}; the robot moved by {to}")

    def lift(self, pose: Pose2D) -> None:
        """Put the robot somewhere else, at rest; odometry does not notice."""
        if self._push is not None:
            self._push = None
            self.physics.grip()
        self.drive.halt()
        self.physics.place(pose)
        self._trail.clear()
        self._friction.update(pose)
        if self._imu:
            self._imu.reset_velocity()
        where = f"({pose.x:.2f}, {pose.y:.2f}, {pose.heading:.2f})"
        self.report("lifted", f"the robot was lifted to {where}")

    def report(self, kind: str, text: str, **fields: Any) -> None:
        """Keep an event until `take_events`."""
        self._events.append(SimulationEvent(kind, text, fields))

    def take_events(self) -> list[SimulationEvent]:
        """Return the events since the last call."""
        events, self._events = self._events, []
        return events

    def _plan_rates(self, description: RobotDescription) -> None:
        rates = {name: lidar.rate for name, lidar in description.real_lidars.items()}
        rates |= {name: sonar.rate for name, sonar in description.sonars.items()}
        self._range_schedules = {name: physics_schedule(rate) for name, rate in rates.items()}
        self._plan_ranges()
        self._imu_schedule = physics_schedule(
            description.imu.rate if description.imu else CLEARANCE_RATE
        )
        self._clearance_schedule = physics_schedule(CLEARANCE_RATE)

    def _turn_wheels(self) -> None:
        """Control the speeds of the wheels by torques, as a driver without speed control does."""
        motion, physics = self._wheel_motion, self.physics
        torques = self.drive.torques(motion.encoder_speeds(physics.wheel_speeds()))
        physics.set_wheel_torques(*motion.motor_torques(torques))
        if steering := self.drive.wheels.steering:
            physics.steer(steering)

    def impair_wheels(self, wheels: Mapping[int, float], *, grip: bool) -> None:
        """Give driven wheels this share of their power, or of their grip on the floor, from now on.

        Args:
            wheels: share by number of the wheel, in the order of the drivetrain's joints.
            grip: whether it is that of the grip.
        """
        if not isinstance(self._wheel_motion, FaultyWheels):
            self._wheel_motion = FaultyWheels(self._wheel_motion, self.physics)
        self._encoder_angles()  # what was turned so far had the shares before
        shares = self._wheel_motion.grip if grip else self._wheel_motion.power
        for wheel, share in wheels.items():
            shares[wheel] = share
        if self._push is None:
            self._set_wheels()

    def _set_wheels(self) -> None:
        if self.drive.controls_torques:
            return  # in the next physics step
        wheels = self.drive.wheels
        self.physics.set_wheel_speeds(*self._wheel_motion.motor_speeds(wheels.speeds))
        if wheels.steering:
            self.physics.steer(wheels.steering)

    def _read_encoders(self, time: float) -> None:
        if self._odometry is not None:
            self._odometry.update(time, *self._encoder_angles())

    def _encoder_angles(self) -> tuple[Sequence[float], list[float]]:
        """Return the angles that the driven wheels have rolled, and of the steered wheels."""
        wheels = self._wheel_motion.encoder_angles(self.physics.wheel_angles())
        return wheels, self.physics.steering_angles()

    def _count_contacts(self, time: float, truth: GroundTruth) -> None:
        touching = [*self.physics.touching(), *self._fallen(truth.pose)]
        self.touched = depths(touching, self.physics.tilt) if touching else {}
        if self.is_pushed:
            self._pushed_at = time
        # What touches the robot while it is pushed is the push's contact, not the drive's.
        drives = time - self._pushed_at > PUSH_ENDS and is_driving(truth.twist)
        moves = drives or (self.arm is not None and self.arm.is_moving)
        if self._contacts.update(time, bool(touching), moves):
            touch, (x, y) = touching[0], touching[0].place
            by = f" of {touch.by}" if touch.by else ""
            self.report(
                "contact", f"contact{by} with {touch.name} at ({x:.2f}, {y:.2f})",
                touched=touch.name, is_person=touch.is_person, at=[round(x, 2), round(y, 2)],
                **({"by": touch.by} if touch.by else {}),
            )  # fmt: skip

    def _fallen(self, pose: Pose2D) -> list[Touch]:
        """Return the drops below the robot, at the place of the base.

        It falls when a wheel, or a point at three quarters of the way to the outline, has no floor.
        """
        if not self._drops:
            return []
        below = np.concatenate(
            [self.physics.wheel_places, 0.75 * self.description.footprint.points]
        )
        points = pose.transform(below)
        here = pose.x, pose.y
        return [Touch(d.name or "a drop", here) for d in self._drops if d.contains(points)]

    def _measure(self, name: str, scene: SceneState, step: int, time: float) -> None:
        truth = self.truth.pose
        if name not in self._lidars:
            self._measured[name] = self._sonars[name].reading(truth, scene, step, time)
            return
        lidar = self._lidars[name]
        self._follow(time, truth)
        if self._trail[0][0] > time - lidar.duration + ROUNDING:
            return  # its first beams are from before the beginning
        scan = lidar.scan(self._trail, scene, step, time)
        self._measured[name] = replace(scan, mount=self.description.real_lidars[name].mount)

    def _follow(self, time: float, pose: Pose2D) -> None:
        """Add a pose to the trail, and forget those before the longest scan that ends now."""
        trail = self._trail
        if not trail or time > trail[-1][0]:
            trail.append((time, pose))
        while len(trail) > 1 and trail[1][0] <= time - self._longest_scan + ROUNDING:
            trail.popleft()


def _arm_of(description: RobotDescription, physics: PhysicsRobot) -> SimulatedArm | None:
    """Return what drives the arm of a robot; None without one."""
    if description.arm is None:
        return None
    assert physics.arm is not None
    return SimulatedArm(description.arm, physics.arm)


def _cameras(robot: RobotDescription) -> dict[str, CameraDescription | DepthCameraDescription]:
    """Return the cameras of a robot by name."""
    colour = {} if robot.camera is None else {CAMERA: robot.camera}
    return {**colour, **robot.depth_cameras}
