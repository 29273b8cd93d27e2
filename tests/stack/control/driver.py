"""A controller that follows a path as the navigator lets it, without the rest of the navigator."""

from stack.control.path_follower import PathFollower
from stack.errors import NavigationError
from stack.types import STANDSTILL, FailureCode

PATIENCE = 1.0
"""Seconds without a safe command after which the failure is raised, not a standstill returned."""


class Driver:
    """Owns the progress on a path and waits before obstacles, like a drive of the navigator.

    Attributes:
        follower: the path follower.
        progress: on the current path; None before the first.
    """

    def __init__(self, create, parameters, robot, period, *, patience=PATIENCE):
        self.follower = PathFollower(create, parameters, robot, period)
        self.progress, self._patience, self._since = None, patience, None

    @property
    def controller(self):
        return self.follower._forward

    @property
    def parameters(self):
        return self.follower.parameters

    @property
    def local_plan(self):
        return self.follower.local_plan

    def configure(self, parameters):
        self.follower.configure(parameters)

    def set_path(self, path):
        self.progress = self.follower.progress_on(path)
        self.follower.follow(self.progress)

    def command(self, state):
        if self.progress is not None:
            self.progress.advance(state.pose)
        try:
            twist = self.follower.step(state)
        except NavigationError as error:
            self._since = state.time if self._since is None else self._since
            blocked = error.failure.code == FailureCode.COLLISION_AHEAD
            if not blocked or state.time - self._since >= self._patience:
                raise
            return STANDSTILL
        self._since = None
        return twist
