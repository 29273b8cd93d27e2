"""Bodies for tests of commissioning: a simulated scout, and one whose measurements are altered."""

from dataclasses import replace
from pathlib import Path

from missions.execution.resources import load_robot, load_world
from robots.scripted import ScriptedBody, scans_of
from robots.simulated import SimulatedBody
from stack.body import Body
from stack.types import Imu, Observation

HERE = Path(__file__).parent


def simulated(robot="scout", world="small_room", seed=0, start=None):
    """A simulated robot, by name or description, in a shipped world."""
    place = load_world(world, HERE)
    described = load_robot(robot, HERE) if isinstance(robot, str) else robot
    return SimulatedBody(described, place, start=start or place.start, seed=seed)


def scripted():
    """A scripted robot with a lidar and sonars, and without an IMU."""
    described = replace(load_robot("scout", HERE), imu=None)
    place = load_world("small_room", HERE)
    return ScriptedBody(described, scans_of(described, place), start=place.start)


class Altered(Body):
    """A body whose measurements are changed on their way."""

    def __init__(self, body, alter, *, real_time=False):
        self.body, self._alter, self._real_time = body, alter, real_time

    @property
    def description(self):
        return self.body.description

    @property
    def time(self):
        return self.body.time

    @property
    def health(self):
        return self.body.health

    @property
    def is_real_time(self):
        return self._real_time

    def sense(self):
        observation = self.body.sense()
        changed = {
            name: self._alter(name, measured) for name, measured in observation.measurements.items()
        }
        return Observation(
            observation.time, {name: it for name, it in changed.items() if it is not None}
        )

    def command(self, command):
        self.body.command(command)

    def wait(self, period):
        self.body.wait(period)

    def close(self):
        self.body.close()


def silent(sensor):
    return lambda name, measured: None if name == sensor else measured


def turned_gyro(name, measured):
    """The sign of the gyro's rates is wrong."""
    if not isinstance(measured, Imu):
        return measured
    return replace(measured, angular_velocity=-measured.angular_velocity)


def restamped(sensor, stamp_of):
    """The clock of a sensor shows `stamp_of(stamp)`."""

    def alter(name, measured):
        return replace(measured, stamp=stamp_of(measured.stamp)) if name == sensor else measured

    return alter


def low_battery(name, measured):
    return replace(measured, charge=0.08) if name == "battery" else measured
