"""Self-documenting settings: declarations of parameters and ports, and how files write values."""

from __future__ import annotations

from stack.parameters.declarations import (
    REQUIRED,
    Declaration,
    build,
    check_relations,
    declarations,
    has_fields,
    parameter,
    refuse_changes,
    type_name,
    values_of,
)
from stack.parameters.names import did_you_mean, likely, nearest, suggestion, superfluous, write
from stack.parameters.poses import FARTHEST, read_pose
from stack.parameters.quantities import quantity_unit, read_quantity, unit_elsewhere, units

__all__ = [
    "FARTHEST",
    "REQUIRED",
    "Declaration",
    "build",
    "check_relations",
    "declarations",
    "did_you_mean",
    "has_fields",
    "likely",
    "nearest",
    "parameter",
    "quantity_unit",
    "read_pose",
    "read_quantity",
    "refuse_changes",
    "suggestion",
    "superfluous",
    "type_name",
    "unit_elsewhere",
    "units",
    "values_of",
    "write",
]
