"""The agent of an environment in the place of a controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from missions.execution.prepare import PreparedMission
from stack.components import Choice
from stack.control.policy.controller import PolicyController
from stack.control.policy.observations import Values, Vector
from stack.control.policy.parameters import PolicyParameters
from stack.drivetrain.description import RobotDescription


class Agent:
    """Between an environment and the controllers of its episode.

    Attributes:
        observed: newest observations that a controller has asked about, by name.
        is_asked: whether a controller waits for a decision.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin another episode."""
        self.observed: Mapping[str, Values] = {}
        self.is_asked = False
        self._asking: AgentController | None = None

    def ask(self, controller: AgentController, observed: Mapping[str, Values]) -> None:
        """Note what a controller observes; `act` answers."""
        self._asking, self.observed, self.is_asked = controller, observed, True

    def act(self, action: Vector) -> None:
        """Let the controller that has asked last drive an action from its next step on."""
        assert self._asking is not None
        self._asking.command = self._asking.actions.twist(action)
        self.is_asked = False


@dataclass(frozen=True)
class AgentParameters(PolicyParameters):
    """Parameters of `AgentController`."""

    agent: Agent = field(default_factory=Agent)


class AgentController(PolicyController):
    """Controller whose velocity comes from outside the run."""

    Parameters = AgentParameters
    parameters: AgentParameters

    def decide(self, observed: Mapping[str, Values]) -> None:
        self.parameters.agent.ask(self, observed)


def with_agent(plan: PreparedMission, parameters: AgentParameters) -> PreparedMission:
    """Return the plan with an agent in the place of its controller.

    Raises:
        InputError: the robot lacks what is observed.
    """
    robot: RobotDescription = plan.robot
    AgentController.check(parameters, robot)
    choice = Choice("controller", "agent", AgentController, parameters)
    return replace(plan, choices={**plan.choices, "controller": choice})
