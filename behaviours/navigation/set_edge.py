"""Closing and opening edges of the route graph."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.errors import ParameterError
from stack.types import FailureCode


class SetEdge(RobotBehaviour):
    """Close or open an edge of the route graph of `planner: {use: route}`.

    A running drive replans at once. Fails if the graph has no such edge.
    """

    needs = ("base",)
    fails_with = ()
    edge_port = "edge"

    edge: str = port("id of the edge, as in the GeoJSON file")
    closed: bool = port("true closes the edge, false opens it", default=True)

    def update(self) -> Status:
        try:
            self.robot.base.set_edge(self.edge, closed=self.closed)
        except ParameterError as error:
            hint = f"; {error.hint}" if error.hint else ""
            return self.fail(FailureCode.FAILED, f"{error.sentence}{hint}")
        self.feedback_message = f"{self.edge} is {'closed' if self.closed else 'open'}"
        return Status.SUCCESS
