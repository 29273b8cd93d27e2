"""What the records of a run show about its decisive failure."""

from __future__ import annotations

from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from missions.execution.records.plan_facts import PlanFacts
from missions.inspection.causes.cause import Fact, share
from missions.inspection.page.failed_nodes import FailedNode
from missions.inspection.page.story import Story
from stack.navigation.landmarks import Landmarks
from stack.runtime.holdups import covered
from stack.telemetry.records import Event, Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import CostGrid, FloatArray, Pose2D, wrap_angle

WINDOW = 30.0
"""Seconds before the failure that are looked at, at least; the whole run of the failing leaf."""

STALL_RADIUS = 0.3
"""Metres within which a robot does not get ahead."""

STALLED_FOR, STALLED_WITHIN = 3.0, 0.05
"""Seconds in which a robot that gets less far than these metres does not get ahead."""

RIGHT_WITHIN, RIGHT_HEADING = 0.3, pi / 18.0
"""Metres and radians within which the health of an estimate says that the pose is right."""

MOST_SHOTS = 200
"""Snapshots of that time that are read."""


class Evidence:
    """What the records show about the failure of a run.

    Args:
        story: of the run.
        failed: the node whose failure is explained; None if no node of the mission failed.

    Attributes:
        shots: snapshots before the end of the failure, ascending, at least one.
    """

    def __init__(self, story: Story, failed: FailedNode | None) -> None:
        self.story, self.failed = story, failed
        self.shots = self._read()

    @property
    def events(self) -> tuple[Event, ...]:
        """All events of the run."""
        return self.story.events

    @property
    def code(self) -> str:
        """Failure code of the decisive node; empty without one."""
        return "" if self.failed is None else self.failed.code

    @property
    def end(self) -> float:
        """Robot time of the failure, or else of the end of the run, seconds."""
        return self.story.end if self.failed is None else self.failed.time

    @property
    def begin(self) -> float:
        """Robot time at which what failed began, seconds."""
        return 0.0 if self.failed is None else self.failed.begin

    @property
    def last(self) -> Snapshot:
        """The snapshot at the failure."""
        return self.shots[-1]

    @property
    def before(self) -> Snapshot:
        """The last snapshot with a goal, in which the robot still drove; the newest without one."""
        return next((shot for shot in reversed(self.shots) if shot.goal is not None), self.last)

    @property
    def facts(self) -> PlanFacts:
        """What was known of the mission before it began."""
        return self.story.facts

    def told(self, kind: str, since: float | None = None) -> list[Event]:
        """Return the events of a kind up to the failure, from a time on."""
        first = -np.inf if since is None else since
        return [
            event for event in self.events
            if event.kind == kind and first <= event.time <= self.end + 1e-6
        ]  # fmt: skip

    def values(self, read: Any) -> FloatArray:
        """Return a figure of each snapshot."""
        return np.array([read(shot) for shot in self.shots], dtype=np.float64)

    @cached_property
    def times(self) -> FloatArray:
        """Robot time of each snapshot, seconds."""
        return self.values(lambda shot: shot.time)

    @cached_property
    def spans(self) -> FloatArray:
        """Seconds that each snapshot stands for: up to the next one."""
        return np.append(np.diff(self.times), 0.0)

    @cached_property
    def stalled(self) -> int:
        """How many of the last snapshots show the robot within STALL_RADIUS of its last place."""
        end = self.last.odometry
        gone = [
            number for number, shot in enumerate(self.shots)
            if shot.odometry.distance_to(end) > STALL_RADIUS
        ]  # fmt: skip
        return len(self.shots) - (gone[-1] + 1 if gone else 0)

    @property
    def is_stalled(self) -> bool:
        """Whether the robot has not got ahead in the last seconds before the failure."""
        since = int(np.searchsorted(self.times, self.end - STALLED_FOR))
        earlier = self.shots[min(since, len(self.shots) - 1)]
        return earlier.odometry.distance_to(self.last.odometry) < STALLED_WITHIN

    def held_share(self, cause: str) -> float:
        """Return the share of the time that a cause has cost: of the standstill, or of the node.

        A robot that is slower loses the part of the time by which it is.
        """
        lost = np.array([self._loss(shot, cause) for shot in self.shots]) * self.spans
        inside = self.times >= self.begin
        standing = np.arange(len(self.shots)) >= len(self.shots) - self.stalled
        return max(
            share(float(lost[part].sum()), float(self.spans[part].sum()))
            for part in (inside, standing)
        )

    def held_facts(self, cause: str) -> list[Fact]:
        """Return for how long a cause held the robot while the node ran; empty if it did not."""
        spans = [
            (max(hold.begin, self.begin), min(hold.end, self.end))
            for hold in self.story.holds if hold.cause == cause and hold.end > self.begin
        ]  # fmt: skip
        seconds, name = covered(spans), "the run" if self.failed is None else self.failed.name
        length = self.end - self.begin
        words = f"held by {cause} for {seconds:.1f} of the {length:.1f} s of {name}"
        return [Fact(words)] if seconds > 0.0 else []

    def _loss(self, shot: Snapshot, cause: str) -> float:
        if not any(one.cause == cause for one in shot.limitations):
            return 0.0
        if any(one.stands and one.cause == cause for one in shot.limitations):
            return 1.0
        top = float(shot.parameters.get("controller.cruise_speed", 0.0))
        return 1.0 - share(abs(shot.commanded.linear), top) if top else 0.0

    def costmap(self, name: str) -> CostGrid | None:
        """Return a costmap at the failure."""
        layer = self.before.layers.get(name)
        content = None if layer is None else layer.content
        return content if isinstance(content, CostGrid) else None

    @property
    def trust(self) -> float:
        """Return how far what depends on the pose may be believed: 1, down to 0 at a wrong pose."""
        return 1.0 - share(pose_error(self.before) - 1.0, 1.0)

    @cached_property
    def landmarks(self) -> Landmarks:
        """Names of the mission's places, and of the doors of its world."""
        places = {name: Pose2D(x, y) for name, (x, y) in self.story.places.items()}
        return Landmarks(places, self.facts.doors)

    @property
    def inscribed_radius(self) -> float:
        """Metres from the centre of the robot to its outline."""
        return self.story.footprint.inscribed_radius

    def _read(self) -> list[Snapshot]:
        with SnapshotRecording(self.story.folder) as recording:
            first = recording.index_at(min(self.begin, self.end - WINDOW))
            last = recording.index_at(self.end + 1e-6)
            every = max(1, -(-(last - first + 1) // MOST_SHOTS))
            numbers = sorted({*range(first, last + 1, every), last})
            return [recording.snapshot(number) for number in numbers]


def pose_error(shot: Snapshot) -> float:
    """Return the error of the pose, in multiples of what counts as right; 0 without a truth."""
    if shot.truth is None:
        return 0.0
    turned = abs(wrap_angle(shot.pose.heading - shot.truth.heading))
    return max(shot.pose.distance_to(shot.truth) / RIGHT_WITHIN, turned / RIGHT_HEADING)
