"""The motion of an arm: it waits for rest, is planned, begins, is watched, and ends.

While something is in its way the arm stands on it. After a few seconds another way is planned, and
after `LONGEST_WAIT` the motion fails.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.lifecycle import Timers
from stack.manipulation.scene import Scene
from stack.navigation.capabilities.gripper import PATIENCE
from stack.navigation.capabilities.motion_watch import JOINTS, MotionWatch
from stack.navigation.capabilities.trajectory_check import ARRIVED
from stack.navigation.plans.arm_plans import ArmPlans, Job, Obstructed
from stack.navigation.plans.deferred import Deferred
from stack.navigation.tasks import MotionTask
from stack.types import (
    CurrentStep,
    Failure,
    FailureCode,
    JointState,
    JointTrajectory,
    Limitation,
    Perceived,
)
from stack.types.limitations import OBSTACLE, STOPPED

STANDS_WITHIN = 10.0
"""Seconds in which arm and base come to rest before a motion: a heavy base needs some."""

OTHER_WAY = 3.0
"""Seconds for which the arm stands before another way is planned."""

LONGEST_WAIT = 30.0
"""Seconds for which something may be in the way of a motion, in all."""

Use = Callable[[Any], None]


@dataclass
class _Planning:
    """A task that waits for a plan; the job is submitted once the arm stands."""

    task: MotionTask
    job: Job[Any]
    use: Use
    wanted_at: float
    answer: Deferred[Any] | None = None
    obstacle: str = ""
    again_at: float = -np.inf


@dataclass
class _Motion:
    """What the arm moves along; `job` plans another way to the same goal."""

    task: MotionTask
    trajectory: JointTrajectory
    job: Job[JointTrajectory] | None = None
    stood: float = 0.0


class ArmMotion:
    """Moves an arm along one trajectory at a time.

    Args:
        arm: description.
        now: what the step has perceived.
        timers: stand still while the arm is held.
        plans: of its motions.
        watch: on its way.
        scene: returns what surrounds the arm now.
    """

    def __init__(  # noqa: PLR0913 - what it is connected with
        self, arm: ArmDescription, now: CurrentStep, timers: Timers, plans: ArmPlans,
        watch: MotionWatch, scene: Callable[[Perceived], Scene],
    ) -> None:  # fmt: skip
        self._arm, self._now = arm, now
        self._plans, self._watch, self._scene = plans, watch, scene
        self._timer, self._rest = timers.new(), timers.new()
        self._obstructed, self._stood = timers.new(), timers.new()
        self._planning: _Planning | None = None
        self._motion: _Motion | None = None
        self._waiting: _Motion | None = None
        self._new: JointTrajectory | None = None
        self._stops = False

    @property
    def is_busy(self) -> bool:
        """Whether a motion or a search is planned or under way."""
        return any(it is not None for it in (self._planning, self._waiting, self._motion))

    @property
    def trajectory(self) -> JointTrajectory | None:
        """What the arm moves along now; None while it rests or plans."""
        return None if self._motion is None else self._motion.trajectory

    @property
    def waits(self) -> bool:
        """Whether the arm stands on its way because something is in it."""
        return self._motion is not None and self._watch.since is not None

    @property
    def limitation(self) -> Limitation | None:
        """Why the arm stands although it wants to move; None if it does not."""
        planning = self._planning
        if self.waits:
            return Limitation(STOPPED, OBSTACLE, f"the arm waits: {self._watch.contact}")
        if planning is not None and planning.obstacle:
            return Limitation(STOPPED, OBSTACLE, f"the arm waits: {planning.obstacle}")
        return None

    def plan(self, task: MotionTask, job: Job[Any], use: Use | None = None) -> None:
        """Plan once the arm stands, and use the result; by default, move along it."""
        self.cancel("a newer motion of the arm")
        now = self._now.perceived.time
        self._planning = _Planning(task, job, use or partial(self._begin, task, job), now)
        self._rest.start(now)
        self._obstructed.reset()
        task.report("planning", 0.0)

    def follow(
        self, task: MotionTask, trajectory: JointTrajectory, job: Job[JointTrajectory] | None
    ) -> None:
        """Move along a trajectory once the base stands.

        Args:
            task: to report to.
            trajectory: the way.
            job: plans another one to its end if something is in the way; None: it waits only.
        """
        self.cancel("a newer motion of the arm")
        self._waiting = _Motion(task, trajectory, job)
        self._rest.start(self._now.perceived.time)
        self._begin_once_standing(self._now.perceived)

    def cancel(self, why: str) -> None:
        """Cancel what is under way; the arm stops."""
        for begun in (self._motion, self._waiting, self._planning):
            if begun is not None:
                begun.task.cancel(why)

    def fail(self, code: FailureCode, sentence: str) -> None:
        """End what is under way with a failure; the arm stops."""
        for begun in (self._motion, self._waiting, self._planning):
            if begun is not None:
                begun.task.fail(code, sentence)

    def step(self, perceived: Perceived, *, held: bool) -> tuple[JointTrajectory | None, bool]:
        """Go on; return a new trajectory, and whether the arm shall stop for good."""
        self._watch.measure(perceived)
        if not held:
            self._prepare(perceived)
            self._begin_once_standing(perceived)
        new, self._new = self._new, None
        if new is None and self._motion is not None:
            if not held:
                self._look(self._motion, perceived)
            if self._motion is not None:
                self._follow(self._motion, perceived)
        stops, self._stops = self._stops, False
        return new, stops

    def ended(self, task: MotionTask) -> None:
        """A task of this arm has ended; call for each."""
        self._drop_plan()
        self._waiting = None
        if self._motion is not None:
            self._motion, self._new, self._stops = None, None, True
            self._stood.reset()
            self._watch.end()

    def _prepare(self, perceived: Perceived) -> None:
        """Ask for the plan once arm and base stand; use it when it is due."""
        planning, now = self._planning, perceived.time
        if planning is None:
            return
        if planning.answer is None:
            joints = perceived.newest(JOINTS, JointState)
            ready = self._watch.is_ready(now, planning.wanted_at)
            if joints is None:
                self._keep_waiting(planning.task, "the joints are not measured", now)
            elif not joints.stands:
                self._keep_waiting(planning.task, "the arm does not come to rest", now)
            elif not perceived.motion.twist.stands:
                self._keep_waiting(planning.task, "the base does not come to rest", now)
            elif ready and now >= planning.again_at:
                planning.answer = self._plans.ask(
                    planning.job, joints.positions, self._scene(perceived), now, self._watch.take()
                )
            return
        answer = planning.answer.result(now)
        if isinstance(answer, Obstructed):
            self._plan_again(planning, answer.sentence, now)
        elif isinstance(answer, Failure):
            self._refused(planning, answer, now)
        elif answer is not None:
            self._planning = None
            planning.use(answer)

    def _refused(self, planning: _Planning, failure: Failure, now: float) -> None:
        """Fail, or, if the arm stands on its way, wait there."""
        if self._motion is None:
            planning.task.fail(failure.code, failure.sentence)
        else:
            self._plan_again(planning, failure.sentence, now)

    def _plan_again(self, planning: _Planning, sentence: str, now: float) -> None:
        """Something measured is in every way: wait for it to go."""
        self._obstructed.start_once(now)
        planning.answer, planning.obstacle = None, sentence
        planning.again_at = now + OTHER_WAY
        self._rest.start(now)
        planning.task.report(f"waits: {sentence}", 0.0)
        if self._motion is None and self._obstructed.elapsed(now) > LONGEST_WAIT:
            planning.task.fail(FailureCode.NO_MOTION_PLAN, f"{sentence}, for {LONGEST_WAIT:g} s")

    def _begin_once_standing(self, perceived: Perceived) -> None:
        """Begin a motion that needs no plan if the base stands."""
        waiting = self._waiting
        if waiting is None:
            return
        if perceived.motion.twist.stands:
            self._waiting = None
            self._begin(waiting.task, waiting.job, waiting.trajectory)
        else:
            self._keep_waiting(waiting.task, "the base does not come to rest", perceived.time)

    def _keep_waiting(self, task: MotionTask, why: str, now: float) -> None:
        """Fail a task that has waited too long for arm and base to stand."""
        if self._rest.elapsed(now) > STANDS_WITHIN:
            task.fail(FailureCode.NO_PROGRESS, f"{why} within {STANDS_WITHIN:g} s")

    def _begin(
        self, task: MotionTask, job: Job[JointTrajectory] | None, trajectory: JointTrajectory
    ) -> None:
        now, before = self._now.perceived.time, self._motion
        stood = 0.0 if before is None else before.stood + self._stood.elapsed(now)
        self._motion = _Motion(task, trajectory, job, stood)
        self._timer.start(now)
        self._stood.reset()
        self._new, self._stops = trajectory, False
        self._watch.begin(trajectory, self._plans.newest_picture)

    def _look(self, motion: _Motion, perceived: Perceived) -> None:
        """Stand while something is in the way; plan another way, or fail, when it stays."""
        now, watch = perceived.time, self._watch
        watch.step(perceived, partial(self._scene, perceived))
        if watch.since is None:
            if self._stood.running:
                self._go_on(motion, now)
            return
        self._stood.start_once(now)
        stood = self._stood.elapsed(now)
        motion.task.report(f"waits for {stood:.1f} s: {watch.contact}", 0.0)
        if motion.stood + stood > LONGEST_WAIT:
            sentence = f"{watch.contact}, for {motion.stood + stood:.0f} s"
            motion.task.fail(FailureCode.ARM_COLLISION, sentence)
        elif stood > OTHER_WAY and self._planning is None and motion.job is not None:
            again = partial(self._begin, motion.task, motion.job)
            self._planning = _Planning(motion.task, motion.job, again, now)
            self._rest.start(now)

    def _go_on(self, motion: _Motion, now: float) -> None:
        """Leave the time in which the arm stood out, and the plan of another way."""
        stood = self._stood.elapsed(now)
        motion.stood += stood
        self._timer.skip(now - stood, now)
        self._stood.reset()
        self._drop_plan()

    def _drop_plan(self) -> None:
        if self._planning is not None and self._planning.answer is not None:
            self._planning.answer.drop()
        self._planning = None

    def _follow(self, motion: _Motion, perceived: Perceived) -> None:
        """End the task when the arm has arrived, or does not arrive."""
        task, trajectory = motion.task, motion.trajectory
        joints, elapsed = perceived.newest(JOINTS, JointState), self._timer.elapsed(perceived.time)
        assert joints is not None, "every motion begins at measured positions"
        if joints.problem:
            task.fail(FailureCode.ARM_COLLISION, joints.problem)
        if not task.running or self._stood.running:
            return
        left = max(0.0, trajectory.duration - elapsed)
        task.report(f"{left:.1f} s to go", 0.0)
        errors = np.abs(joints.positions - trajectory.positions[-1])
        if left == 0.0 and errors.max() < ARRIVED and joints.stands:
            task.succeed("arrived")
        elif elapsed > trajectory.duration + PATIENCE:
            worst = int(errors.argmax())
            name, off = self._arm.joints[worst], float(errors[worst])
            task.fail(FailureCode.NO_PROGRESS, f"{name} is still {off:.3f} from its goal")
