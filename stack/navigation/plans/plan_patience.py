"""How long a drive waits while its plans fail."""

from __future__ import annotations

from collections.abc import Callable

from stack.errors import NavigationError
from stack.lifecycle import Timers
from stack.navigation.drive_tools import DriveTools
from stack.navigation.people.standoff import PERSON_DISTANCE, blocked_by, nearest
from stack.types import Failure, FailureCode, Perceived, Pose2D, TrackedObject

CLOSED_BY_PERSON = frozenset({FailureCode.NO_VALID_PATH, FailureCode.GOAL_OCCUPIED})
"""Failures of a plan that a person in the way can cause."""

PATIENCE_RESTARTS_AT = 0.1
"""Metres that the robot must move to restart the patience after a failed plan. Smaller motions in
front of an obstacle do not count.
"""


class PlanPatience:
    """Retries failed plans: `patience` seconds, or `person_patience` if a person may be why.

    Args:
        tools: of the drive.
        goal: the last goal, map frame.
        timers: of the drive.
    """

    def __init__(self, tools: DriveTools, goal: Pose2D, timers: Timers) -> None:
        self._tools, self._goal = tools, goal
        self._failing = timers.new()
        self._failing_at = Pose2D(0.0, 0.0)

    @property
    def failing(self) -> bool:
        """Whether the last plan failed."""
        return self._failing.running

    def reset(self) -> None:
        """Start over: a plan was found."""
        self._failing.reset()

    def failed(
        self, failure: Failure, perceived: Perceived, explain: Callable[[Failure], Failure],
        *, follows_path: bool,
    ) -> None:  # fmt: skip
        """Note that a plan failed.

        Args:
            failure: of the plan.
            perceived: in this step.
            explain: returns the failure with a sentence that says more, once the patience is over.
            follows_path: whether the robot goes on along an earlier path meanwhile.

        Raises:
            NavigationError: the failure, when the patience is over; BLOCKED_BY_PERSON if a person
                is near the robot, the goal, or the place at which the way ends.
        """
        p, here = self._tools.parameters, perceived.motion.pose
        moved = follows_path and self._failing_at.distance_to(here) > PATIENCE_RESTARTS_AT
        if moved or not self._failing.running:
            self._failing.start(perceived.time)
            self._failing_at = here
        waited = self._failing.elapsed(perceived.time)
        person = self._person_near(perceived, failure)
        if person is not None and waited < p.person_patience:
            return
        if waited >= p.patience:
            if person is not None and failure.code in CLOSED_BY_PERSON:
                raise blocked_by(person, p.person_patience, self._tools.landmarks)
            raise NavigationError(FailureCode(failure.code), explain(failure).sentence)

    def _person_near(self, perceived: Perceived, failure: Failure) -> TrackedObject | None:
        """Return a person who may be why there is no path: near the robot, the goal or its end."""
        around = 2.0 * PERSON_DISTANCE
        places = [(perceived.estimate.pose, around), (self._goal, around)]
        if failure.place is not None:
            places.append((Pose2D(*failure.place), PERSON_DISTANCE))
        found = (nearest(perceived.world.tracks, place, reach) for place, reach in places)
        return next((person for person in found if person is not None), None)
