"""Parameters of the failsafes, in a module that imports none of the loop's parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stack.errors import ParameterError
from stack.parameters import Declaration, parameter

NONE, WARN, PAUSE, STOP, HOME, ABORT = "none", "warn", "pause", "stop", "home", "abort"

ACTIONS = (NONE, WARN, PAUSE, STOP, HOME, ABORT)
"""What a failsafe does: nothing; an event; pause the mission; emergency stop; pause the mission and
drive to where the run began; end the mission as aborted."""

HOLDING = (PAUSE, STOP, ABORT)
"""The actions that a fault of the robot itself may have: it cannot drive, or must not."""

_METRES = Declaration("fence", float, unit="m")


def _action(
    default: str, condition: str, of: tuple[str, ...] = ACTIONS, *, public: bool = True
) -> Any:
    return parameter(default, one_of=of, public=public, help=f"what to do when {condition}")


@dataclass(frozen=True)
class FailsafeParameters:
    """What the robot does by itself when something is wrong, once each time that it becomes so.

    `pause` keeps the mission, `stop` needs a release too, `home` pauses it and drives to where the
    run began, `abort` ends it. The safety stage, which stops for obstacles and old measurements,
    works beside them and always.
    """

    link: str = _action(PAUSE, "the robot does not answer", HOLDING)
    motor: str = _action(PAUSE, "a motor reports an error", HOLDING)
    pilot: str = _action(PAUSE, "a pilot takes over by the transmitter", HOLDING)
    clock: str = _action(PAUSE, "the robot's clock jumps", HOLDING, public=False)
    fast_loop: str = _action(PAUSE, "the fast loop does not answer", HOLDING, public=False)
    hardware: str = _action(PAUSE, "the robot reports another problem", HOLDING)
    low_battery: str = _action(WARN, "the charge is below low_charge")
    low_charge: float = parameter(0.2, at_least=0.0, at_most=1.0, help="share of a full battery")
    critical_battery: str = _action(ABORT, "the charge is below critical_charge")
    critical_charge: float = parameter(
        0.05, at_least=0.0, not_above="low_charge", help="share of a full battery"
    )
    lost: str = _action(NONE, "the robot has not known where it is for lost_time; it stands then")
    lost_time: float = parameter(10.0, "s", at_least=0.0, help="of the pose being lost")
    silent_sensor: str = _action(NONE, "a lidar, sonar or IMU delivers nothing for silent_time")
    silent_time: float = parameter(2.0, "s", at_least=0.0, help="of the silence")
    operator: str = _action(NONE, "no operator has been heard for operator_time, after one was")
    operator_time: float = parameter(
        5.0, "s", at_least=1.0, help="wall time without a dashboard or ground station"
    )
    geofence: str = _action(STOP, "the base is outside the fence")
    fence: tuple[Any, ...] = parameter(
        (), help="corners [x, y] of the area that the base must not leave, metres, map frame"
    )
    late: str = _action(WARN, "many control steps of a real robot take longer than their period")
    late_share: float = parameter(
        0.2, above=0.0, at_most=1.0, help="share of late steps in the last two seconds"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "fence", tuple(map(_corner, self.fence)))
        if 0 < len(self.fence) < 3:
            raise ParameterError(
                "fence", f"{len(self.fence)} corners; a fence has at least three, [x, y] each"
            )


def _corner(raw: Any) -> tuple[float, float]:
    if not isinstance(raw, list | tuple) or len(raw) != 2:
        raise ParameterError("fence", f"a corner is [x, y] in metres, got {raw!r}")
    return _METRES.read(raw[0]), _METRES.read(raw[1])
