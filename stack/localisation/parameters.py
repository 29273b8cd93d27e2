"""Parameters of estimators and odometry, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import parameter, suggestion


def check_lidar(name: str, robot: RobotDescription) -> None:
    """Check that the robot has the lidar of a name; empty: its main lidar.

    Raises:
        InputError: it has none of that name.
    """
    if name and name not in robot.all_lidars:
        hint = suggestion(name, list(robot.all_lidars))
        raise InputError(f"{robot.name} has no lidar {name!r}; {hint}")


@dataclass(frozen=True)
class LocaliserParameters:
    """Parameters of the particle filter, of its health and of the global search."""

    lidar: str = parameter(
        "", public=True,
        help="name of the lidar that weights the particles; empty: the robot's main lidar",
    )  # fmt: skip
    initial_position_deviation: float = parameter(
        0.1, "m", at_least=0.0, public=True,
        help="standard deviation of the initial position of the mission",
    )  # fmt: skip
    initial_heading_deviation: float = parameter(
        0.05, "rad", at_least=0.0, public=True,
        help="standard deviation of the initial heading of the mission",
    )  # fmt: skip
    min_particles: int = parameter(
        300, at_least=50, at_most=20000, not_above="max_particles", public=True,
        help="number of particles when the pose is certain",
    )  # fmt: skip
    max_particles: int = parameter(
        3000, at_least=50, at_most=20000, public=True, help="number of particles over the whole map"
    )
    beams: int = parameter(
        60, at_least=10, at_most=720, public=True, help="beams of a scan that weight the particles"
    )
    recover: bool = parameter(
        True, help="search the map by itself when the scans stop fitting; false: only when asked"
    )
    lost_health: float = parameter(
        0.3, at_least=0.0, at_most=1.0, not_above="good_health", public=True,
        help="health below which the robot counts as lost",
    )  # fmt: skip
    good_health: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="health from which on the pose counts as right"
    )
    # In a drawn office the 5th percentile of the fits is 0.67 with 7 obstacles, while 99 % of
    # kidnaps have a fit below 0.57 two seconds later.
    health_obstacles: int = parameter(
        7, at_least=0, at_most=50,
        help="up to so many people, moved chairs or closed doors around the robot are normal; "
        "more lower the health",
    )  # fmt: skip


@dataclass(frozen=True)
class DeadReckoningParameters:
    """None: the drift follows from the robot's wheels and gyro."""


@dataclass(frozen=True)
class OdometryFusionParameters:
    """How wheels and gyro are combined, and when the gyro's bias is measured."""

    settling_time: float = parameter(
        0.25, "s", at_least=0.0, help="time at standstill before the gyro's bias is measured"
    )
    gyro_timeout: float = parameter(
        0.1, "s", above=0.0,
        help="time without gyro samples after which the wheels measure the rotation",
    )  # fmt: skip
