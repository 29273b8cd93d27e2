"""The kinds of sensor drivers: which one reads a sensor is the robot file's choice.

A plugin registers a class that inherits `SensorDriver` in the entry-point group
`treepilot.sensor_drivers`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from stack.drivetrain.description import LidarDescription
from stack.parameters import build
from stack.plugins import named_class
from stack.types import Measurement

GROUP = "treepilot.sensor_drivers"

BUILT_IN = {
    "rplidar": "robots.sensor_drivers.rplidar:RplidarDriver",
    "udp_scan": "robots.sensor_drivers.udp_scan:UdpScanDriver",
}


class SensorDriver(ABC):
    """Reads one sensor, in a thread of its own. Its module must import nothing heavy.

    Args:
        lidar: the sensor's description.
        parameters: instance of `Parameters`.
        clock: returns seconds, for the stamps.

    Attributes:
        Parameters: a frozen dataclass of `parameter(...)` fields: `sensors: {lidar: {use: NAME}}`.
    """

    Parameters: ClassVar[type]

    def __init__(
        self, lidar: LidarDescription, parameters: Any, clock: Callable[[], float]
    ) -> None:
        self.lidar, self.parameters, self.clock = lidar, parameters, clock

    @abstractmethod
    def open(self) -> None:
        """Connect. It is called again, after a while, when it or `read` has failed.

        Raises:
            OSError, BodyError: the sensor does not respond; in its own words.
        """

    @abstractmethod
    def read(self) -> Measurement | None:
        """Wait at most a second for a measurement; None if there is none.

        Raises:
            OSError, BodyError: the sensor is gone, or reports a fault.
        """

    @abstractmethod
    def close(self) -> None:
        """Stop the sensor and disconnect. It must not raise; it is also called before `open`."""


def driver_kind(name: str) -> type[SensorDriver]:
    """Return a kind of driver, a built-in one or a plugin's.

    Raises:
        InputError: there is none of this name, or the plugin cannot be used.
    """
    return named_class("sensor driver", name, GROUP, BUILT_IN, SensorDriver)  # type: ignore[type-abstract]


def checked_parameters(name: str, values: Mapping[str, Any]) -> Any:
    """Return the parameters of a driver.

    Raises:
        InputError: there is no such driver.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    return build(driver_kind(name).Parameters, dict(values))
