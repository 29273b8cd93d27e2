"""The motions under way: the mission's, and an operator's detour while the mission is held."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from stack.errors import NavigationError, exception_sentence, traceback_text
from stack.navigation.doubt import LocalisationMonitor, step_in_doubt
from stack.navigation.parameters import NavigationParameters
from stack.navigation.tasks import Emit, MotionExecutor, MotionTask
from stack.types import STANDSTILL, FailureCode, Perceived, TaskStatus, Twist


class Activities:
    """Runs at most one motion of the mission, and one detour while that is held.

    It calls the whole lifecycle of the executors. An exception in one of them fails its task.

    Args:
        emit: called with (kind, text, level="info", **fields) for each event.
        monitor: holds motions while the robot is lost.

    Attributes:
        paused: whether the motion of the mission is held.
        detour_held: whether the detour is held too.
    """

    def __init__(
        self, emit: Emit, monitor: LocalisationMonitor, log: Callable[[str], None] = lambda _: None
    ) -> None:
        self._emit, self.monitor, self._log = emit, monitor, log
        self._mission: MotionExecutor | None = None
        self._detour: MotionExecutor | None = None
        self._started: list[MotionExecutor] = []
        self._waiting: MotionExecutor | None = None
        self.paused = self.detour_held = False

    @property
    def current(self) -> MotionExecutor | None:
        """The motion that is stepped, from the next step on; None without one."""
        executor = self._mission
        if self.paused:
            executor = None if self.detour_held else self._detour
        return executor if executor is not None and executor.task.running else None

    @property
    def shown(self) -> MotionExecutor | None:
        """The motion to display: the current one, or else the held one of the mission."""
        mission = self._mission
        held = mission if mission is not None and mission.task.running else None
        return self.current or held

    def begin(self, executor: MotionExecutor) -> None:
        """Run an executor from the next step on; cancels the current one.

        While the mission's motion is held, this is a detour: `resume` cancels it.
        """
        replaced = self._detour if self.paused else self._mission
        if replaced is not None and replaced.task.running:
            replaced.task.cancel(f"replaced: {executor.task.what}")
        if self.paused:
            self._detour, self.detour_held = executor, False
        else:
            self._mission = executor

    def start(self, executor: MotionExecutor, kind: str, text: str) -> None:
        """Run an executor as `begin` does, and emit an event of a kind with a text."""
        self.begin(executor)
        self._emit(kind, text)

    def task(self, what: str, *, moves: bool = True, while_lost: bool = False) -> MotionTask:
        """Return a task handle whose end is an event.

        Args:
            what: is done, for people.
            moves: whether it is a motion.
            while_lost: whether it also moves a robot that is lost.
        """
        return MotionTask(what, partial(self._ended, moves=moves), while_lost=while_lost)

    def _ended(self, task: MotionTask, *, moves: bool) -> None:
        failure, status = task.failure, task.status
        level = "warning" if status is TaskStatus.FAILED else "info"
        word = status.name.lower()
        why = f": {task.feedback}" if task.feedback else ""
        code = "" if failure is None else str(failure.code)
        text = f"{task.what} {word}{why}"
        self._emit("task", text, level, status=word, code=code, moves=moves)

    def pause(self, now: float) -> None:
        """Hold the mission's motion; does nothing while it is held."""
        if self.paused:
            return
        mission, self.paused = self._mission, True
        if mission in self._started:
            self._guarded(mission, lambda: mission.pause(now))

    def hold_detour(self, now: float, *, held: bool) -> None:
        """Hold the detour, which keeps its goal and its time limits, or continue it."""
        if held is self.detour_held:
            return
        detour, self.detour_held = self._detour, held
        if detour in self._started:
            self._guarded(detour, lambda: detour.pause(now) if held else detour.resume(now))

    def resume(self, now: float) -> None:
        """Cancel a detour and continue the mission's motion; does nothing unless held."""
        if not self.paused:
            return
        if self._detour is not None:
            self._detour.task.cancel("the mission continues")
        self.stop_ended(now)
        self.detour_held = False
        mission, self.paused = self._mission, False
        if mission in self._started:
            self._guarded(mission, lambda: mission.resume(now))

    def step(
        self, perceived: Perceived, parameters: NavigationParameters, *, waits: bool = False
    ) -> Twist:
        """Step the current motion; STANDSTILL without one.

        Args:
            perceived: in this step.
            parameters: of navigation.
            waits: whether the motion is paused in this step, or does not begin yet.
        """
        self.stop_ended(perceived.time)
        executor, twist = self.current, STANDSTILL
        if executor is None:
            return STANDSTILL
        if waits:
            self._wait(executor, perceived.time)
            return STANDSTILL
        if self._waiting is executor and executor in self._started:
            self._guarded(executor, lambda: executor.resume(perceived.time))
        self._waiting = None
        if executor not in self._started:
            self._started.append(executor)
            self._guarded(executor, lambda: executor.start(perceived.time))
        if executor.task.running:
            call = partial(step_in_doubt, executor, self.monitor, perceived, parameters)
            twist = self._guarded(executor, call) or STANDSTILL
        self.stop_ended(perceived.time)
        return twist if executor.task.running else STANDSTILL

    def _wait(self, executor: MotionExecutor, now: float) -> None:
        self._waiting = executor
        if executor in self._started:
            self._guarded(executor, lambda: executor.pause(now))

    def cancel(self, why: str) -> None:
        """Cancel all motions, also one that is held."""
        for executor in (self._mission, self._detour):
            if executor is not None:
                executor.task.cancel(why)

    def stop_ended(self, now: float) -> None:
        """Stop the executors whose task has ended; every step does so too."""
        for executor in [item for item in self._started if not item.task.running]:
            self._started.remove(executor)
            try:
                executor.stop(now)
            except Exception as error:  # a controller may be a plugin
                what = f"{executor.task.what} raised an exception when it stopped"
                text = f"{what}: {exception_sentence(error)}"
                self._log(traceback_text(what, error))
                self._emit("task", text, "warning")

    def _guarded(self, executor: MotionExecutor, call: Callable[[], Twist | None]) -> Twist | None:
        """Make a call of the lifecycle; an exception fails the task."""
        try:
            return call()
        except NavigationError as error:
            executor.task.fail(error.failure.code, error.failure.sentence)
        except Exception as error:  # a controller may be a plugin
            what = f"{executor.task.what} raised an exception"
            self._log(traceback_text(what, error))
            sentence = f"{what}: {exception_sentence(error)}"
            executor.task.fail(FailureCode.EXCEPTION, sentence)
        return None
