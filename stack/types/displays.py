"""What displays show of the sensors and the parameters of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from stack.types.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class SensorState:
    """How often a sensor delivers.

    Attributes:
        name: of the sensor.
        rate: measurements per second of the robot's clock in the last seconds, Hz.
        expected: Hz, by the robot file; 0: it states none, or nothing is requested now.
        age: seconds since its newest measurement; inf before the first.
    """

    name: str
    rate: float = 0.0
    expected: float = 0.0
    age: float = inf

    @property
    def is_slow(self) -> bool:
        """Whether it delivers less than 80 % of what is expected."""
        return self.rate < 0.8 * self.expected


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """What a parameter is, for people who change it in a running mission.

    Attributes:
        name: of component and parameter: controller.cruise_speed.
        type: number in m/s, whole number, true or false…
        unit: SI unit; empty for a plain number and for what is no number.
        range: the allowed values as text; empty if all are.
        help: one sentence.
        public: users may need it; the others are for experts.
        start: value at the begin of the run.
    """

    name: str
    type: str
    unit: str = ""
    range: str = ""
    help: str = ""
    public: bool = True
    start: Any = None


@dataclass(frozen=True, slots=True)
class ParameterTable:
    """The parameters of a run that can be changed while it runs."""

    parameters: tuple[ParameterInfo, ...] = ()


LATENESS_BINS: tuple[float, ...] = tuple(1e-6 * 2.0 ** (number / 2.0) for number in range(48))
"""Ends of the bins in which a fast loop counts how late its cycles begin, seconds."""


@dataclass(frozen=True, eq=False, slots=True)
class HeldBlock:
    """The block in the hand.

    Attributes:
        pose: (4, 4) of its centre in the base frame, metres.
        size: (3,) along x, y and z, metres.
        colour: red, green, blue in [0, 1].
    """

    pose: FloatArray
    size: FloatArray
    colour: tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class ArmView:
    """Measured state of an arm, with what a display needs to know of it.

    Attributes:
        joints: names, from the base to the hand.
        positions: (n,) radians.
        lower: (n,) limits, radians.
        upper: (n,) limits, radians.
        moving: whether a joint moves.
        tool: (4, 4) pose of the tool in the base frame, metres.
        problem: why the arm stopped by itself; empty if it did not.
        width: of the gripper, metres; 0 without one.
        width_max: of the open gripper, metres; 0 without one.
        force: with which its fingers press, N.
        speed: of the fastest joint, rad/s or m/s.
        fingers: positions of the fingers' joints by name, metres.
        links: (k, 3) origins of the links from the base to the tool, base frame, metres.
        way: (n, 3) of the tool in the motion that goes on, base frame, metres.
        grasps: (n, 4, 4) poses of the tool at the grasps that were found, the best one first, base
            frame, metres.
        held: None: the hand is empty.
    """

    joints: tuple[str, ...]
    positions: FloatArray
    lower: FloatArray
    upper: FloatArray
    moving: bool
    tool: FloatArray
    problem: str = ""
    width: float = 0.0
    width_max: float = 0.0
    force: float = 0.0
    speed: float = 0.0
    fingers: Mapping[str, float] = field(default_factory=dict)
    links: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    way: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    grasps: FloatArray = field(default_factory=lambda: np.zeros((0, 4, 4)))
    held: HeldBlock | None = None


@dataclass(frozen=True, slots=True)
class LoopStatistics:
    """Timing of a fast loop since it began.

    Attributes:
        rate: cycles per second, as wanted.
        cycles: done.
        overruns: deadlines missed by a whole period or more.
        worst: longest time from a deadline until the loop ran, seconds.
        work: mean time that a cycle computes, seconds.
        worst_work: longest, seconds.
        late: number of cycles by their lateness; the bins end at LATENESS_BINS.
        lacks: privileges that it did not get: `priority: Operation not permitted`.
    """

    rate: float
    cycles: int = 0
    overruns: int = 0
    worst: float = 0.0
    work: float = 0.0
    worst_work: float = 0.0
    late: tuple[int, ...] = ()
    lacks: tuple[str, ...] = ()

    def percentile(self, share: float) -> float:
        """Lateness that a share of all cycles did not exceed, seconds; the end of its bin."""
        wanted, counted = share * sum(self.late), 0
        for number, end in zip(self.late, LATENESS_BINS, strict=False):
            counted += number
            if counted >= wanted:
                return min(end, self.worst)
        return self.worst
