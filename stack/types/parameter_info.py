"""What the parameters of a running mission are, for people who change them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
