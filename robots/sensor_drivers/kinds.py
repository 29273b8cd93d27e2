"""The kinds of sensor drivers: which one reads a sensor is the robot file's choice.

A plugin registers a class that inherits `SensorDriver` in the entry-point group
`treepilot.sensor_drivers`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, ClassVar

from stack.drivetrain.description import LidarDescription
from stack.errors import InputError
from stack.parameters import build, suggestion
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
    places = dict(BUILT_IN)
    for entry in entry_points(group=GROUP):
        places.setdefault(entry.name, entry.value)
    if name not in places:
        raise InputError(
            f"there is no sensor driver {name!r}",
            f"{suggestion(name, places)}; one of your own is an installed package with the entry "
            f"point `{name}` of `{GROUP}`",
        )
    module, _, attribute = places[name].partition(":")
    try:
        found: Any = getattr(import_module(module), attribute)
    except Exception as error:  # a plugin's module may raise any exception
        raise InputError(f"the sensor driver {name!r} cannot be used: {error}") from error
    if not (isinstance(found, type) and issubclass(found, SensorDriver)):
        raise InputError(
            f"the sensor driver {name!r} cannot be used: it does not inherit SensorDriver"
        )
    return found


def checked_parameters(name: str, values: Mapping[str, Any]) -> Any:
    """Return the parameters of a driver.

    Raises:
        InputError: there is no such driver.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    return build(driver_kind(name).Parameters, dict(values))
