"""A second physics engine for tests: flat ground, wheels that never slip, no contacts."""

from math import cos, inf, sin

import numpy as np

from stack.drivetrain.kinematics import moved
from stack.sim.physics.engine import BaseState, PhysicsEngine, PhysicsRobot, Renderer
from stack.sim.rates import PHYSICS_PERIOD
from stack.types import Pose2D, Twist


class KinematicRobot(PhysicsRobot):
    """A robot that moves exactly as its wheels roll."""

    def __init__(self, description, start):
        self._drivetrain, self._radius = description.drivetrain, description.wheels.radius
        half = description.wheels.separation / 2.0
        self.wheel_places = np.array([[0.0, half], [0.0, -half]])
        self._start = start
        self.load()

    def load(self):
        self._angles = [0.0, 0.0]
        self.place(self._start)

    def place(self, pose):
        self._pose, self._speeds, self._pushed = pose, (0.0, 0.0), None

    def step(self, period):
        self._angles = [
            angle + period * speed for angle, speed in zip(self._angles, self._speeds, strict=True)
        ]
        self._pose = self._pose.compose(moved(self._twist, period))

    @property
    def _twist(self):
        if self._pushed is not None:
            x, y, spin = self._pushed
            c, s = cos(self._pose.heading), sin(self._pose.heading)
            return Twist(c * x + s * y, spin, c * y - s * x)
        rolled = [self._radius * speed for speed in self._speeds]
        twist = self._drivetrain.from_wheels(rolled, (0.0, 0.0))
        return Twist(twist.x, twist.heading, twist.y)

    def base_state(self):
        x, y, heading = self._pose.x, self._pose.y, self._pose.heading
        c, s, twist = cos(heading), sin(heading), self._twist
        return BaseState(
            (x, y, 0.0), (0.0, 0.0, sin(heading / 2.0), cos(heading / 2.0)),
            (c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
            (c * twist.linear - s * twist.lateral, s * twist.linear + c * twist.lateral, 0.0),
            (0.0, 0.0, twist.angular),
        )  # fmt: skip

    def set_wheel_speeds(self, *speeds):
        self._speeds = speeds

    def set_wheel_torques(self, *torques):
        raise NotImplementedError("this engine has no forces")

    def wheel_speeds(self):
        return list(self._speeds)

    def steer(self, angles):
        assert not angles

    def wheel_angles(self):
        return self._angles

    def steering_angles(self):
        return []

    def set_wheel_friction(self, wheel, friction):
        pass

    def slide(self):
        self._pushed = (0.0, 0.0, 0.0)

    def grip(self):
        self._pushed = None

    def set_velocity(self, x, y, spin):
        self._pushed = (x, y, spin)

    def touching(self):
        return []

    def distance(self, reach):
        return reach


class GreyRenderer(Renderer):
    """Draws grey pictures of nothing."""

    driver = ""

    def __init__(self, model):
        self._shape = (model.height, model.width)

    def draw(self, request, view):
        depths = np.ones(self._shape, dtype=np.float32)
        return np.full((*self._shape, 3), 128, dtype=np.uint8), depths

    def close(self):
        pass


class KinematicEngine(PhysicsEngine):
    """Moves the robots; doors and people are in nobody's way."""

    def __init__(self, world):
        self._period, self._robots = PHYSICS_PERIOD, []

    def add_robot(self, description, start: Pose2D):
        self._robots.append(KinematicRobot(description, start))
        return self._robots[-1]

    def step(self, count=1):
        for _ in range(count):
            for robot in self._robots:
                robot.step(self._period)

    def place_door(self, name, closed):
        pass

    def place_people(self, positions):
        pass

    def reset(self):
        for robot in self._robots:
            robot.load()

    def close(self):
        pass

    @classmethod
    def own_ranges(cls, model, lidar):
        return np.full(lidar.beams, inf)

    @classmethod
    def renderer(cls, setup, model, mirror=None):
        return GreyRenderer(model)
