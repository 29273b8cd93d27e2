"""Close or open an edge of the route graph."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.errors import ParameterError
from stack.types import FailureCode


class SetEdge(RobotBehaviour):
    """Close or open an edge of the route graph that `planner: {use: route}` plans on.

    A drive under way plans anew at once. Fails when there is no such edge.
    """

    edge: str = port("id of the edge, as in the GeoJSON file")
    closed: bool = port("whether nobody may drive on it from now on", default=True)

    def update(self) -> Status:
        """Change it at once."""
        try:
            self.robot.set_edge(self.edge, closed=self.closed)
        except ParameterError as error:
            hint = f"; {error.hint}" if error.hint else ""
            return self.fail(FailureCode.FAILED, f"{error.sentence}{hint}")
        self.feedback_message = f"{self.edge} is {'closed' if self.closed else 'open'}"
        return Status.SUCCESS
