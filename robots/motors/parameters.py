"""Parameters of the body `wheels`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stack.errors import InputError, ParameterError
from stack.fast_loop.driver import driver_class
from stack.parameters import build, parameter


@dataclass(frozen=True)
class WheelsParameters:
    """Wheels that a fast loop holds."""

    driver: Any = parameter(
        "emulated", help="driver of the wheels, by name, or {use: NAME, …} with its parameters"
    )
    rate: float = parameter(
        500.0, "Hz", at_least=50.0, at_most=1000.0, help="cycles of the fast loop per second"
    )
    opens_within: float = parameter(
        30.0, "s", above=0.0, at_most=600.0, help="time in which the driver must connect"
    )

    def __post_init__(self) -> None:
        name, values = self.named_driver
        try:
            build(driver_class(name).Parameters, values)
        except (InputError, ParameterError) as error:
            raise ParameterError("driver", str(error)) from None

    @property
    def named_driver(self) -> tuple[str, dict[str, Any]]:
        """Name and parameters of the driver, as in the file.

        Raises:
            ParameterError: there is no name.
        """
        values = dict(self.driver) if isinstance(self.driver, Mapping) else {"use": self.driver}
        name = values.pop("use", None)
        if not isinstance(name, str):
            sentence = f"expected a name, or a mapping with `use`, got {self.driver!r}"
            raise ParameterError("driver", sentence, "write e.g. driver: emulated")
        return name, values
