"""The faults of one robot in a run: begins and ends them, and applies those that last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, inf, log

from stack.errors import InputError
from stack.parameters import declarations
from stack.sim.disturbances import disturb
from stack.sim.faults.fault import BEFORE, LASTING, NOW, Fault, Target
from stack.sim.faults.planned import PlannedFault
from stack.sim.faults.registry import fault_kind
from stack.sim.simulated_robot import SimulatedRobot
from stack.sim.simulation import Simulation
from stack.streams import stream
from stack.types import Observation, Pose2D

ROUNDING = 1e-9
"""Seconds by which two times that are meant to be the same may differ."""


@dataclass
class _State:
    """A planned fault in a run: when it may begin, how often it has, and what lasts now."""

    planned: PlannedFault
    begins: float
    count: int = 0
    running: Fault | None = None
    began: float = 0.0


class FaultSchedule:
    """Begins and ends the faults of one robot, each at its time and place.

    Random times and numbers are drawn from a stream for each fault, by its name.

    Args:
        faults: of the run.
        simulation: with the robot.
        robot: that they befall.
    """

    def __init__(
        self, faults: Sequence[PlannedFault], simulation: Simulation, robot: SimulatedRobot
    ) -> None:
        self._simulation, self._robot = simulation, robot
        self._target = Target(simulation, robot, partial(disturb, simulation, robot))
        self.restart(faults)

    def restart(self, faults: Sequence[PlannedFault]) -> None:
        """Begin again at time 0 with these faults, and the robot's seed."""
        self._states = [_State(fault, self._first(fault)) for fault in faults]
        self._settings: dict[str, float | None] = {}

    def update(self) -> None:
        """Begin and end what is due."""
        if not self._states:
            return
        time, pose = self._simulation.time, self._robot.truth.pose
        for state in self._states:
            running, planned = state.running, state.planned
            if running is not None and time >= state.began + planned.duration - ROUNDING:
                self._end(state, running, time)
            if state.running is None and _is_due(state, time, pose):
                self._begin(state, time)

    def applied(self, observation: Observation) -> Observation:
        """Return what the sensors deliver, faulty as they are now."""
        for state in self._states:
            if state.running is not None:
                measurements = state.running.measured(
                    dict(observation.measurements), observation.time
                )
                observation = replace(observation, measurements=measurements)
        return observation

    def take_settings(self) -> dict[str, float | None]:
        """Return the live parameters that have changed since the last call; None: as before."""
        settings, self._settings = self._settings, {}
        return settings

    def _first(self, planned: PlannedFault) -> float:
        """Return the time from which a fault may begin for the first time."""
        if fault_kind(planned.kind).kind == BEFORE:
            return 0.0
        return planned.time + self._pause(planned, 0)

    def _pause(self, planned: PlannedFault, count: int) -> float:
        """Return the seconds before an occurrence: of a Poisson process, or 0."""
        if not planned.per_minute:
            return 0.0 if count == 0 else inf
        mean = -60.0 / log(1.0 - planned.per_minute)
        return float(stream(self._robot.seed, f"fault at {planned.name}", count).exponential(mean))

    def _begin(self, state: _State, time: float) -> None:
        planned = state.planned
        kind = fault_kind(planned.kind)
        random = stream(self._robot.seed, f"fault {planned.name}", state.count)
        fault = kind(planned.parameters, random)
        state.count += 1
        text, name = f"fault {planned.name}: {_numbers(planned)}".rstrip(": "), planned.name
        self._robot.report("fault", text, fault=name, lasts=kind.kind != NOW)
        try:
            fault.begin(self._target)
        except InputError as error:
            self._robot.report("fault_end", f"fault {name} has no effect: {error}", fault=name)
            state.begins = time + self._pause(planned, state.count)
            return
        self._settings |= fault.settings
        if kind.kind == LASTING:
            state.running, state.began = fault, time
        else:
            state.begins = time + self._pause(planned, state.count)

    def _end(self, state: _State, fault: Fault, time: float) -> None:
        fault.end(self._target)
        self._settings |= dict.fromkeys(fault.settings)
        state.running, name = None, state.planned.name
        state.begins = time + self._pause(state.planned, state.count)
        seconds = round(time - state.began, 3)
        self._robot.report("fault_end", f"fault {name} is over", fault=name, seconds=seconds)


def _is_due(state: _State, time: float, pose: Pose2D) -> bool:
    if time < state.begins - ROUNDING:
        return False
    if state.planned.near is None:
        return True
    x, y, radius = state.planned.near
    return hypot(pose.x - x, pose.y - y) <= radius


def _numbers(planned: PlannedFault) -> str:
    """Return the parameters of a fault for people."""
    parts = []
    for name, declared in declarations(fault_kind(planned.kind).Parameters).items():
        value = getattr(planned.parameters, name)
        if value not in (None, ""):
            shown = f"{value:g}" if isinstance(value, float) else str(value)
            parts.append(f"{name} {shown} {declared.unit}".rstrip())
    return ", ".join(parts)
