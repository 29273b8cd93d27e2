"""Failsafes: what the robot does by itself when something is wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stack.body import BodyHealth
from stack.geometry.polygons import points_inside
from stack.runtime.failsafe_parameters import NONE, WARN, FailsafeParameters
from stack.types import Perceived

RECOVERED = 0.05
"""Charge above a limit with which a low battery is over: without load its voltage rises."""

LATE_FOR = 10.0
"""Seconds in which less than half of `late_share` must be late until that is over: the load of a
machine comes in bursts, and of 40 steps that are late with a chance of 20 %, 8 ± 2.5 are."""


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that is wrong now.

    Attributes:
        name: of the parameter that says what to do about it.
        reason: a sentence for people.
        key: two conditions with different keys are two faults, each with its own reaction.
    """

    name: str
    reason: str
    key: str = ""


class FailsafeInput(NamedTuple):
    """What the failsafes look at in a step.

    Attributes:
        perceived: of this step.
        health: of the body.
        silence: seconds for which each silent sensor has delivered nothing.
        operator_silence: wall seconds since an operator was heard; 0 if there never was one.
        late_share: of the last control steps; 0 for a simulation.
    """

    perceived: Perceived
    health: BodyHealth
    silence: Mapping[str, float]
    operator_silence: float = 0.0
    late_share: float = 0.0


class Reaction(NamedTuple):
    """What to do: pause | stop | home | abort; and why."""

    action: str
    reason: str


class Failsafes:
    """Decides once for each condition when it begins, and tells when it is over.

    Args:
        parameters: what to do about each.
        emit: called with (kind, text, level=…, **fields).

    Attributes:
        parameters: the current ones.
    """

    def __init__(self, parameters: FailsafeParameters, emit: Callable[..., object]) -> None:
        self.parameters = parameters
        self._emit = emit
        self._begun: dict[tuple[str, str], float] = {}
        self._lost_since: float | None = None
        self._late_at = 0.0

    def configure(self, parameters: FailsafeParameters) -> None:
        """Apply new parameters."""
        self.parameters = parameters

    def update(self, given: FailsafeInput) -> list[Reaction]:
        """Return what to do about what has become wrong in this step."""
        time = given.perceived.time
        wrong = {(one.name, one.key): one for one in self._conditions(given)}
        for name, key in [key for key in self._begun if key not in wrong]:
            held = time - self._begun.pop((name, key))
            if getattr(self.parameters, name) != NONE:
                self._emit(
                    "failsafe_end", f"{name.replace('_', ' ')}: over after {held:.1f} s",
                    source="failsafe", level="info", condition=name, seconds=held,
                )  # fmt: skip
        begins = [number for number in wrong if number not in self._begun]
        self._begun |= dict.fromkeys(begins, time)
        reactions = [self._announced(wrong[number]) for number in begins]
        return [reaction for reaction in reactions if reaction.action not in (NONE, WARN)]

    def _announced(self, condition: Condition) -> Reaction:
        """Emit the event of a condition that begins."""
        action = getattr(self.parameters, condition.name)
        reaction = Reaction(action, condition.reason)
        if action == NONE:
            return reaction
        self._emit(
            "failsafe", f"{reaction.reason} ({action})",
            source="failsafe", level="warning" if action == WARN else "error",
            condition=condition.name, reason=condition.reason, action=action,
        )  # fmt: skip
        return reaction

    def _conditions(self, given: FailsafeInput) -> Iterator[Condition]:
        settings, perceived, health = self.parameters, given.perceived, given.health
        if health.problem:
            yield Condition(health.fault, health.problem, health.problem)
        charge = perceived.battery.charge
        if charge < self._limit("critical_battery", settings.critical_charge, RECOVERED):
            yield Condition("critical_battery", f"the battery is nearly empty: {charge:.0%}")
        elif charge < self._limit("low_battery", settings.low_charge, RECOVERED):
            yield Condition("low_battery", f"the battery is low: {charge:.0%}")
        lost = self._lost_for(perceived)
        if lost > settings.lost_time:
            yield Condition("lost", f"the pose has been lost for {lost:.0f} s")
        for sensor, silent in given.silence.items():
            if silent > settings.silent_time:
                yield Condition("silent_sensor", f"{sensor} delivers nothing", sensor)
        if given.operator_silence > settings.operator_time:
            yield Condition("operator", f"no operator heard for {given.operator_silence:.0f} s")
        if settings.fence and not self._is_inside(perceived):
            pose = perceived.estimate.pose
            yield Condition("geofence", f"({pose.x:.2f}, {pose.y:.2f}) is outside the fence")
        if self._is_late(given.late_share, perceived.time):
            yield Condition(
                "late", f"{given.late_share:.0%} of the control steps exceed their period"
            )

    def _limit(self, name: str, limit: float, band: float) -> float:
        """The limit at which a condition begins; moved by `band` while it stands."""
        return limit + band if (name, "") in self._begun else limit

    def _is_late(self, share: float, time: float) -> bool:
        """Whether too many steps are late, or were within LATE_FOR."""
        limit = self.parameters.late_share
        if share > self._limit("late", limit, -limit / 2.0):
            self._late_at = time
            return True
        return ("late", "") in self._begun and time - self._late_at < LATE_FOR

    def _lost_for(self, perceived: Perceived) -> float:
        """Seconds for which the pose has been lost."""
        if not perceived.estimate.is_lost:
            self._lost_since = None
            return 0.0
        if self._lost_since is None:
            self._lost_since = perceived.time
        return perceived.time - self._lost_since

    def _is_inside(self, perceived: Perceived) -> bool:
        pose = perceived.estimate.pose
        fence = np.array(self.parameters.fence, dtype=np.float64)
        return bool(points_inside(np.array([[pose.x, pose.y]]), fence)[0])
