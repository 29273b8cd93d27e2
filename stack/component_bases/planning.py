"""Planners: their base class, options of a request, and how a search is cancelled."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from stack.component_bases.component import Component
from stack.errors import NavigationError, ParameterError
from stack.types import CostGrid, FailureCode, Path, Pose2D


class CancelToken:
    """Cancels a search from any thread.

    Attributes:
        flag: (1,) uint8, 0 until cancellation is requested; compiled loops poll it.
    """

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.uint8)

    def request(self) -> None:
        """Request cancellation."""
        self.flag[0] = 1

    def check(self) -> None:
        """Raise NavigationError CANCELLED if cancellation was requested."""
        if self.flag[0]:
            raise NavigationError(FailureCode.CANCELLED, "the plan was cancelled")


@dataclass(frozen=True)
class PlanOptions:
    """Options of a plan request.

    Attributes:
        partial: accept a path to the nearest reachable pose, whatever the planner's parameters.
        direction: +1 or -1 if the robot drives forward or backward at the start of the plan, 0 if
            it stands. Planners with directions count a change of direction there as anywhere.
        cancel: when cancellation is requested, the planner may fail with CANCELLED.
        current: the rest of the path that the robot follows; None unless only a cheaper path is of
            use. A planner may then fail with NO_VALID_PATH where a short search finds none.
    """

    partial: bool = False
    direction: int = 0
    cancel: CancelToken = field(default_factory=CancelToken)
    current: Path | None = None


DEFAULT_PLAN_OPTIONS = PlanOptions()
"""Default options; such a plan is never cancelled."""


class Planner(Component, ABC):
    """A global planner.

    Attributes:
        has_route_graph: whether `with_edge` opens and closes edges of a route graph.
        ignores_outline: whether it keeps only a disc about the base free. Its paths are then
            checked with the outline of robots that are not compact (`Footprint.is_compact`).
    """

    has_route_graph: ClassVar[bool] = False
    ignores_outline: ClassVar[bool] = False

    @abstractmethod
    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Plan a smooth, collision-free path from start to goal, map frame.

        Headings are those of the robot: on backward segments they point against the motion. A
        planner may ignore the options. If it ignores `options.cancel`, an obsolete plan is computed
        to its end before the next one starts. The costs may change after the return: keep a copy
        of what later plans need.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT at the limit of expansions, or CANCELLED.
        """

    def with_edge(self, edge: str, *, closed: bool) -> Planner:
        """Return a copy with an edge of the route graph closed or open.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        raise ParameterError(
            "edge", f"{edge!r}: the planner in use has no route graph",
            "use `planner: {use: route, graph: FILE}`",
        )  # fmt: skip
