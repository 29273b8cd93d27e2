"""Base classes of the components of navigation, and what they get: import from stack.components."""

from __future__ import annotations

from stack.component_bases.component import Component
from stack.component_bases.driving import (
    Controller,
    ControlState,
    DriveState,
    GoalChecker,
    GoalTolerance,
    ProgressChecker,
    StopCriterion,
)
from stack.component_bases.localisation import Estimator, Match, OdometryFusion
from stack.component_bases.planning import (
    DEFAULT_PLAN_OPTIONS,
    CancelToken,
    Planner,
    PlanOptions,
)

__all__ = [
    "DEFAULT_PLAN_OPTIONS",
    "CancelToken",
    "Component",
    "ControlState",
    "Controller",
    "DriveState",
    "Estimator",
    "GoalChecker",
    "GoalTolerance",
    "Match",
    "OdometryFusion",
    "PlanOptions",
    "Planner",
    "ProgressChecker",
    "StopCriterion",
]
