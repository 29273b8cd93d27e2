"""Base class of all components."""

from __future__ import annotations

from typing import Any, ClassVar

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.optional_packages import Package


class Component:
    """Base class of components.

    Attributes:
        Parameters: a frozen dataclass.
        packages: optional packages without which it does not run.
        parameters: current parameters.
        needs: sensors that the robot must have: names of `stack.drivetrain.needs`, or several of
            which one is enough: `lidar or sonar`.
    """

    Parameters: ClassVar[type]
    packages: ClassVar[tuple[Package, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    parameters: Any

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @staticmethod
    def check(parameters: Any, robot: RobotDescription) -> None:
        """Check the parameters against the robot, before anything moves.

        Raises:
            InputError: they do not fit the robot.
        """

    @staticmethod
    def kernels(parameters: Any, robot: RobotDescription) -> KernelTypes:
        """Return the numba functions that a run calls, with the types of their arguments.

        They are compiled before the first step; others are when the run first calls them.
        """
        return ()

    def configure(self, parameters: Any) -> None:
        """Apply new parameters; live tuning calls it between two steps."""
        self.parameters = parameters
