"""Controllers whose velocity a policy decides."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from math import isfinite
from pathlib import Path

from stack.components import Controller, ControlState, GoalTolerance
from stack.control.policy.observations import Actions, Observations, Values, View
from stack.control.policy.parameters import IMAGE, OnnxPolicyParameters, PolicyParameters
from stack.drivetrain.description import RobotDescription
from stack.geometry.path_segment import PathSegment
from stack.parameters import declarations, refuse_changes
from stack.types import STANDSTILL, Twist, wrap_angle


class PolicyController(Controller):
    """Drives what a policy decides, which has a control step of time for it.

    A decision from the observation of one step is driven from the next step on, in training as in a
    mission. Within the goal's tolerance the robot stops, whatever the policy decides.

    Attributes:
        observations: of the policy.
        actions: of the policy.
        command: velocity that is driven from the next step on, base frame.
    """

    parameters: PolicyParameters

    def __init__(
        self, parameters: PolicyParameters, robot: RobotDescription, period: float
    ) -> None:
        super().__init__(parameters, robot, period)
        self.observations = Observations(parameters, robot)
        self.actions = Actions(parameters, robot)
        self.command = STANDSTILL
        self._steps, self._tolerance = 0, GoalTolerance()
        self._segment: PathSegment | None = None

    @staticmethod
    def check(parameters: PolicyParameters, robot: RobotDescription) -> None:
        """Check that the robot has what is observed."""
        Observations(parameters, robot)

    @staticmethod
    def takes_pictures(parameters: PolicyParameters) -> bool:
        """Whether a picture is observed."""
        return IMAGE in parameters.observations

    def configure(self, parameters: PolicyParameters) -> None:
        """Refuse other parameters: a policy is trained with these."""
        kind: type = type(parameters)
        refuse_changes(declarations(kind), self.parameters, parameters)

    def start(self, now: float) -> None:
        self.command, self._steps = STANDSTILL, 0

    def set_tolerance(self, tolerance: GoalTolerance) -> None:
        self._tolerance = tolerance

    def set_segment(self, segment: PathSegment) -> None:
        self._segment = segment

    def step(self, state: ControlState) -> Twist:
        """Return the velocity decided before; let the policy decide the next one when it is due."""
        segment, command = self._segment, self.command
        assert segment is not None
        if self._steps % self.parameters.repeat == 0:
            self.decide(self.observations.observe(View(state, segment, command)))
        self._steps += 1
        return STANDSTILL if self._has_arrived(segment, state) else command

    @abstractmethod
    def decide(self, observed: Mapping[str, Values]) -> None:
        """Set `command`, now or before the next step."""

    def _has_arrived(self, segment: PathSegment, state: ControlState) -> bool:
        limit, goal, pose = self._tolerance, segment.path.goal, state.pose
        if not isfinite(limit.position) or not segment.ends_within(limit.position):
            return False
        turn = abs(wrap_angle(goal.heading - pose.heading))
        return pose.distance_to(goal) <= limit.position and turn <= limit.heading


class OnnxPolicy(PolicyController):
    """Policy controller: drives the velocities of a trained network, an ONNX file."""

    Parameters = OnnxPolicyParameters
    parameters: OnnxPolicyParameters

    def __init__(
        self, parameters: OnnxPolicyParameters, robot: RobotDescription, period: float
    ) -> None:
        from stack.control.policy.network import PolicyNetwork, network_shapes

        super().__init__(parameters, robot, period)
        file, shapes = Path(parameters.file), network_shapes(self.observations)
        self._network = PolicyNetwork(file, shapes, len(self.actions.low))

    def decide(self, observed: Mapping[str, Values]) -> None:
        self.command = self.actions.twist(self._network.decide(observed))
