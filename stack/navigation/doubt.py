"""Motion while the pose is in doubt: stand and fail with a code, or drive slowly for a distance."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from stack.navigation.parameters import NavigationParameters
from stack.navigation.path_speeds import slower
from stack.navigation.tasks import Emit, MotionExecutor
from stack.types import (
    STANDSTILL,
    FailureCode,
    Limitation,
    Perceived,
    PoseEstimate,
    RivalPose,
    Twist,
    wrap_angle,
)
from stack.types.limitations import LOST, OBSCURED, SLOWER, STOPPED

AMBIGUOUS_DISTANCE = 1.5
"""A drive goes on past another pose that is nearer than this, m, and than half of the way to its
goal: the drive resolves it on the way."""


class LocalisationMonitor:
    """Decides what a robot may do whose estimate says that it is lost.

    Where only unmapped things hide the map (`PoseEstimate.obscured`), it drives on by odometry, at
    most at `obscured_speed` and for `obscured_distance`, which counts until the health is good
    again. Otherwise it stands: drives wait `lost_time` for a better pose and fail with LOST then,
    other motions are refused once the robot has been lost for that time.

    Args:
        emit: called with (kind, text, level, **fields) when what it decides changes.
        period: seconds between control steps.

    Attributes:
        speed_limit: m/s; inf without one.
        limitation: why the robot is slowed down or stands; None when it is not.
        obscured_distance: metres driven with the map hidden, in the whole run.
        lost_seconds: time of standing because the robot was lost, in the whole run.
    """

    def __init__(self, emit: Emit, period: float) -> None:
        self._emit, self.period = emit, period
        self.speed_limit = inf
        self.limitation: Limitation | None = None
        self.obscured_distance = self.lost_seconds = 0.0
        self._state = _FINE
        self._lost_for = 0.0
        self._left = inf
        self._last: Perceived | None = None

    @property
    def stands(self) -> bool:
        """Whether the robot must stand."""
        return self._state == _LOST

    def update(self, perceived: Perceived, parameters: NavigationParameters) -> None:
        """Decide for this step; called in each step before the motions."""
        self._count(perceived, parameters)
        before, estimate = self._state, perceived.estimate
        excused = estimate.obscured and parameters.obscured_speed > 0.0 and self._left > 0.0
        self._state = _FINE if not estimate.is_lost else _OBSCURED if excused else _LOST
        self.speed_limit = parameters.obscured_speed if self._state == _OBSCURED else inf
        self._lost_for = self._lost_for + self.period if before == self._state == _LOST else 0.0
        if self._state != before:
            self._changed(estimate, parameters)
        self._last = perceived

    def refuses(self, parameters: NavigationParameters) -> bool:
        """Return whether the robot has been lost for `lost_time`."""
        return self.stands and self._lost_for >= parameters.lost_time - _ROUNDING

    def why(self, estimate: PoseEstimate) -> str:
        """Return the sentence of a motion that fails because the robot is lost."""
        spent = ""
        if estimate.obscured and self._left <= 0.0:
            spent = ", and the distance that may be driven by odometry meanwhile is used up"
        return (
            f"localisation health {estimate.health:.2f}, below {estimate.thresholds.lost:g}: the "
            f"scans do not fit the map here{spent}; run `relocalise` first"
        )

    def refusal(self, estimate: PoseEstimate) -> str:
        """Return the sentence of a motion without a path that fails because the robot is lost."""
        return f"{self.why(estimate)}, or set navigator.lost_motions to drive"

    def _count(self, perceived: Perceived, parameters: NavigationParameters) -> None:
        """Count the distance that is driven while the map is hidden."""
        if perceived.estimate.is_good or self._last is None:
            self._left = parameters.obscured_distance
        elif self._state == _OBSCURED:
            driven = self._last.motion.pose.distance_to(perceived.motion.pose)
            self._left -= driven
            self.obscured_distance += driven
        if self.stands:
            self.lost_seconds += self.period

    def _changed(self, estimate: PoseEstimate, parameters: NavigationParameters) -> None:
        """Set the limitation, and emit an event."""
        health, level = round(estimate.health, 3), "warning"
        if self._state == _OBSCURED:
            speed = f"{parameters.obscured_speed:.2f} m/s by odometry"
            self.limitation = Limitation(SLOWER, OBSCURED, f"{speed}, unmapped things hide the map")
            text = f"{self.limitation.text}; for at most {max(0.0, self._left):.1f} m"
        elif self._state == _LOST:
            self.limitation = Limitation(STOPPED, LOST, "lost, the scans do not fit the map")
            text = f"lost: {self.why(estimate)}"
        else:
            self.limitation, level = None, "info"
            text = f"the scans fit the map again, health {estimate.health:.2f}"
        self._emit("doubt", text, level, doubt=self._state, health=health)


_FINE, _OBSCURED, _LOST = "none", "obscured", "lost"

_OTHER_HEADING = 0.5
"""Radians; a rival that is turned by more is another place, however near."""

_ROUNDING = 1e-9
"""Seconds; a time summed from periods has rounding errors."""


def step_in_doubt(
    executor: MotionExecutor, monitor: LocalisationMonitor, perceived: Perceived,
    parameters: NavigationParameters,
) -> Twist:  # fmt: skip
    """Step a motion if the pose allows it; hold it, or let its task fail, if not.

    Every motion is stepped by this function, whatever behaviour has started it.
    """
    if not executor.while_ambiguous and parameters.ambiguous_goals != "drive":
        if rivals := other_places(executor, perceived.estimate):
            executor.task.fail(FailureCode.AMBIGUOUS, _ambiguity(rivals))
            return STANDSTILL
    free = not executor.follows_map and parameters.lost_motions == "drive"
    if executor.while_lost or free:
        return executor.step(perceived)
    if not monitor.stands:
        executor.let_go(perceived.time)
        return slower(executor.step(perceived), monitor.speed_limit)
    waited = executor.hold(perceived.time, monitor.period) >= parameters.lost_time - _ROUNDING
    if executor.follows_map and waited:
        executor.task.fail(FailureCode.LOST, monitor.why(perceived.estimate))
    elif not executor.follows_map and monitor.refuses(parameters):
        executor.task.fail(FailureCode.LOST, monitor.refusal(perceived.estimate))
    executor.task.report("standing: the scans do not fit the map", executor.task.distance_remaining)
    return STANDSTILL


def other_places(executor: MotionExecutor, estimate: PoseEstimate) -> list[RivalPose]:
    """Return the rivals that a motion cannot tell apart on its way.

    After a push along a corridor the pose may be a metre farther or not. Rivals that near are no
    reason to end a drive that has a longer way before it.
    """
    pose = estimate.pose
    near = min(AMBIGUOUS_DISTANCE, 0.5 * executor.way_left(pose))
    return [
        rival for rival in estimate.rivals
        if rival.pose.distance_to(pose) >= near
        or abs(wrap_angle(rival.pose.heading - pose.heading)) > _OTHER_HEADING
    ]  # fmt: skip


def _ambiguity(rivals: Sequence[RivalPose]) -> str:
    """Return the sentence of a drive that fails because of rivals."""
    nearest = rivals[0].pose
    return (
        f"{len(rivals) + 1} places explain the scans about as well, one of them "
        f"({nearest.x:.2f}, {nearest.y:.2f}): a goal on the map may be anywhere; run "
        "`disambiguate` first, or set navigator.ambiguous_goals to drive"
    )
