"""Parameters of the body `mavlink`."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.mavlink.address import read_address
from stack.parameters import parameter


@dataclass(frozen=True)
class MavlinkParameters:
    """Where the rover is, and what is exchanged with it."""

    connect: str = parameter(
        "udpin:127.0.0.1:14550", public=True,
        help="address: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD",
    )  # fmt: skip
    key: str = parameter(
        "", public=True,
        help="file of the key with which all frames are signed, beside the robot file; others are "
        "refused then; `treepilot keys mavlink` makes one",
    )  # fmt: skip
    autopilot: str = parameter(
        "auto", one_of=("auto", "ardupilot", "px4"), public=True,
        help="kind of autopilot; auto: as its heartbeat says",
    )  # fmt: skip
    system: int = parameter(
        0, at_least=0, at_most=255, public=True,
        help="MAVLink id of the rover; 0: the only one that is there",
    )  # fmt: skip
    own_system: int = parameter(
        245, at_least=1, at_most=255,
        help="MAVLink id of treepilot; ArduPilot's MAV_GCS_SYSID must be the same for its failsafe",
    )  # fmt: skip
    odometry: str = parameter(
        "auto", one_of=("auto", "wheels", "ekf"), public=True,
        help="wheels: WHEEL_DISTANCE; ekf: velocity and attitude of the autopilot; auto: wheels if "
        "the autopilot sends them",
    )  # fmt: skip
    obstacle_distance: str = parameter(
        "lidar", help="lidar of the robot file that OBSTACLE_DISTANCE is the scan of; '': unused"
    )
    rangefinders: tuple[str, ...] = parameter(
        (),
        help="sonars of the robot file that DISTANCE_SENSOR 0, 1, … are the readings of; without: "
        "by direction",
    )  # fmt: skip
    estimate: str = parameter(
        "none", one_of=("none", "vision_position", "odometry"), public=True,
        help="how the rover is told our pose: VISION_POSITION_ESTIMATE, ODOMETRY, or not at all",
    )  # fmt: skip
    origin: tuple[float, ...] = parameter(
        (), public=True,
        help="[latitude, longitude] of the map's origin, degrees, sent as the rover's origin when "
        "it has no GPS",
    )  # fmt: skip
    connect_timeout: float = parameter(
        10.0, "s", above=0.0, at_most=600.0, help="longest wait for the rover's heartbeat"
    )
    arm_timeout: float = parameter(
        90.0, "s", above=0.0, at_most=600.0, public=True,
        help="longest wait until the rover is armed: after a start it needs most of a minute",
    )  # fmt: skip
    least_charge: float = parameter(
        0.1, at_least=0.0, at_most=1.0, public=True,
        help="charge of the battery below which the rover does not start",
    )  # fmt: skip

    def __post_init__(self) -> None:
        read_address(self.connect, signed=bool(self.key))
        object.__setattr__(self, "rangefinders", tuple(self.rangefinders))  # files give lists
        object.__setattr__(self, "origin", tuple(self.origin))
        if self.origin and (
            len(self.origin) != 2 or not abs(self.origin[0]) <= 85 or not abs(self.origin[1]) <= 180
        ):
            raise ParameterError(
                "origin", f"expected [latitude, longitude] in degrees, got {list(self.origin)}"
            )
        if self.origin == (0.0, 0.0):
            raise ParameterError("origin", "autopilots refuse latitude 0, longitude 0", "any other")
