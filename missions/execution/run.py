"""A run of a prepared mission, step by step, with its records.

Every way to run a mission uses it; running.py steps runs to their ends.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter, sleep  # noqa: TID251 - only before the first step

from missions.execution.build import Engine, build, run_info
from missions.execution.connections import network_sinks_of, open_control
from missions.execution.prepare import PreparedMission, RunOptions, as_recorded
from missions.execution.records.inputs import keep_inputs
from missions.execution.records.kept_values import kept_values_of
from missions.execution.records.run_folders import default_name
from missions.execution.report import Report
from missions.execution.report_builder import Milestones, compose_report, unstarted_report
from missions.execution.warm_up import warm_up
from robots.bodies import MakeBody
from stack.body import STOP, SimulatedWorld
from stack.documents.files import noting_inputs
from stack.errors import (
    BodyError,
    InputError,
    TreepilotError,
    WorkerError,
    exception_sentence,
    plugin_line,
    traceback_text,
)
from stack.telemetry.hub import Telemetry, discard, reason_of
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.records import MissionState
from stack.telemetry.rendezvous import RunHandle
from stack.telemetry.sinks import Sink
from stack.telemetry.snapshots.log import SnapshotLog

MAX_SIMULATED_SECONDS = 24 * 3600.0
"""A mission that runs longer is ended as a failure."""

VIEWER_POLL = 0.01
"""Wall seconds between two looks for a dashboard before the first step."""

STOPPING_TIME = 3.0
"""Longest time, seconds, that the robot gets to come to a stop after the end of its mission."""


class RunWatch:
    """Follows a run from outside. This one does nothing: a run in the caller's process has none."""

    def compiles(self) -> None:
        """Called before anything is written, and before kernels are compiled."""

    def prepared(self, draft: Report) -> None:
        """Called when the run folder was created, with the report of a run that ends now."""

    def built(self, run: Run) -> None:
        """Called when the run is ready for its first step."""

    def stepped(self, run: Run) -> None:
        """Called after each step, and while the next one has to wait."""


class Run:
    """A mission that is run.

        run = Run(plan, options)
        try:
            while not run.is_over:
                run.step()
            report = run.finish()
        finally:
            run.close()

    Args:
        plan: the checked mission.
        options: seed, folder and other settings.
        sinks: consumers of events and snapshots, in addition to those of the options.
        make_body: makes the body; None: the choice of the options or of the robot file.
        interrupted: called while kernels are compiled and while a dashboard is awaited; True
            stops that.
        watch: follows the run.

    Raises:
        InputError: the options contradict each other or the plan, or the run cannot be commanded
            as they ask; nothing has moved.

    Attributes:
        engine: the parts of the run.
        read: the files that were read for it, absolute.
    """

    def __init__(  # noqa: PLR0913 - the optional ones by keyword
        self, plan: PreparedMission, options: RunOptions, sinks: Sequence[Sink] = (),
        make_body: MakeBody | None = None, interrupted: Callable[[], bool] = lambda: False,
        watch: RunWatch | None = None,
    ) -> None:  # fmt: skip
        self._began, self._watch = perf_counter(), watch or RunWatch()
        self._interrupted, self._is_alone = interrupted, watch is None
        if options.record and options.out is None:
            raise InputError("`record` needs a run folder: set `out`")
        options = as_recorded(plan, options)
        self._kept = kept_values_of(plan, options)
        # Bad addresses are refused before anything is written.
        network_sinks, self._server = network_sinks_of(options)
        self._watch.compiles()
        self._folder = RunFolder.create(options.out, plan.text) if options.out is not None else None
        self._plan, self._options = plan, options
        self._unstarted = unstarted_report(plan, options, self._folder)
        with self._reports_failure():
            self._build(sinks, network_sinks, make_body)
        self._loop_began, self._first_tick = perf_counter(), 0.0
        self._watch.built(self)

    def _build(
        self, sinks: Sequence[Sink], network_sinks: Sequence[Sink], make_body: MakeBody | None
    ) -> None:
        """Connect the parts of the run."""
        plan, options, folder = self._plan, self._options, self._folder
        self._log = folder.log if folder is not None else discard
        self._milestones = Milestones()
        own: list[Sink] = [self._milestones]
        if folder is not None:
            recording = plan.choices["recording"].parameters
            own += [Recorder(folder), SnapshotLog(folder.snapshots, recording)]
        run_id = folder.path.name if folder is not None else default_name(plan.mission.source.stem)
        info = run_info(plan, run_id, options.seed, options.identity)
        self._log(f"{info.title}: {info.robot} in {info.world}, seed {info.seed}")
        if self._is_alone:
            self._log("no supervisor: a node that does not return hangs this process")
        warm_up(plan, options, self._show, self._interrupted)  # before a dashboard can open the run
        self._telemetry = Telemetry(info, [*own, *sinks, *network_sinks], self._log, self._show)
        if folder is not None:
            folder.on_loss = self._telemetry.lose
        if self._server is not None:
            open_control(self._telemetry, self._server)
        self._report: Report | None = None
        self._is_reported = False
        try:
            with noting_inputs() as read:
                self.engine: Engine = build(
                    plan, options, self._telemetry, folder, make_body,
                    tell=self._show, interrupted=self._interrupted,
                )  # fmt: skip
        except BaseException as error:
            self._telemetry.close(None)
            self._refuse_plugin(error)
            raise
        self.read = (*plan.read, *read)
        if folder is not None:
            kept = None if self._kept is None else self._kept.path
            keep_inputs(folder, plan, options, self.read, kept)
        if self._kept is not None:
            self._kept.restore(self.engine.tree, self._telemetry)
        self._steps_to_stop = round(STOPPING_TIME / self.engine.runtime.period)
        if options.watch:
            self._reload_on_change()

    @property
    def is_over(self) -> bool:
        """Whether the mission is over and the robot stands."""
        runtime = self.engine.runtime
        if not runtime.state.is_over:
            return False
        return self._steps_to_stop <= 0 or runtime.is_standing or self._recording_ended

    @property
    def _recording_ended(self) -> bool:
        """Whether a replay has nothing more to sense."""
        return self.engine.replay is not None and self.engine.replay.has_ended

    @property
    def is_due(self) -> bool:
        """Whether the next step can be taken; not while other robots in the world lag behind."""
        body = self.engine.body
        return not isinstance(body, SimulatedWorld) or body.is_due

    @property
    def state(self) -> MissionState:
        """State of the mission."""
        return self.engine.runtime.state

    @property
    def handle(self) -> RunHandle | None:
        """How to reach the run's telemetry; None if it serves none."""
        return None if self._server is None else self._server.handle

    @property
    def folder(self) -> Path | None:
        """The run folder; None without records."""
        return None if self._folder is None else self._folder.path

    def is_ready(self) -> bool:
        """Wait for at most some milliseconds; return whether `step` can be made without waiting.

        If not, call `serve`, so that operators can command the robot meanwhile.
        """
        return self.engine.runtime.is_ready()

    def serve(self) -> None:
        """Apply the commands of operators and show them the run, without a step."""
        with self._ends_on_error():
            self.engine.runtime.serve()
        self._watch.stepped(self)

    def step(self) -> None:
        """Run one control period; after the end of the mission, stop the robot."""
        runtime = self.engine.runtime
        stopping = runtime.state.is_over
        if stopping:
            self._steps_to_stop -= 1
        with self._ends_on_error():
            if not stopping:
                self.engine.between_steps()
            runtime.step()
            if not stopping:
                self._after_step()
        self._watch.stepped(self)

    def interrupt(self, reason: str = "stopped by a signal") -> None:
        """End the mission; a simulation stops its robot as fast as possible."""
        if self.engine.simulation is not None:
            self.engine.simulation.pace = 0.0
        self.engine.runtime.end(MissionState.INTERRUPTED, reason)

    def pause(self, reason: str) -> None:
        """Pause the mission, as an operator would; the robot stops."""
        self.engine.runtime.pause(reason)

    def finish(self) -> Report:
        """Return the report of the finished run; `close` writes it."""
        self._report = self.draft()
        self._log(self._report.summary())
        return self._report

    @property
    def report(self) -> Report:
        """The report of the finished run; after `close` also with records lost at the end.

        Raises:
            RuntimeError: the run is not finished.
        """
        if self._report is None:
            raise RuntimeError("the run has no report before `finish`")
        return self._report

    def await_viewer(self, patience: float) -> None:
        """Wait until a dashboard has connected, at most `patience` wall seconds."""
        began = perf_counter()
        server = self._server
        while server is not None and not server.watchers and not self._interrupted():
            if perf_counter() - began >= patience:
                break
            self._telemetry.service()
            sleep(VIEWER_POLL)
        waited = perf_counter() - began
        self._began, self._loop_began = self._began + waited, self._loop_began + waited

    def draft(self) -> Report:
        """Return the report with the figures so far."""
        return compose_report(
            self._unstarted, self.engine, self._milestones,
            wall_seconds=perf_counter() - self._loop_began,
            first_tick=(self._first_tick or perf_counter()) - self._began,
        )  # fmt: skip

    def close(self) -> None:
        """Stop the robot, write the report, close every sink and part. Safe to call twice.

        The robot is stopped first: a sink may take long to write what it has, and a planner to end.
        A part that raises an exception does not keep the others open.
        """
        engine, parts = self.engine, self.engine.runtime.parts
        with ExitStack() as parts_left:  # closes the last one first
            if engine.sensor_log is not None:
                parts_left.callback(engine.sensor_log.close)
            parts_left.callback(parts.perceiver.close)
            parts_left.callback(parts.navigator.close, engine.body.time)
            parts_left.callback(parts.limbs.close)
            parts_left.callback(engine.body.close)
            self._stop_robot()
            final = self._report.plain() if self._report is not None else None
            if self._kept is not None:
                self._kept.save(engine.tree, self._telemetry.lose)
            self._telemetry.close(final, engine.runtime.snapshot)
            self._write_report()

    def _stop_robot(self) -> None:
        """Command a standstill at once, not with the next step."""
        try:
            self.engine.body.command(STOP)
        except Exception:  # the records and the other parts must be closed all the same
            self._log(traceback.format_exc())

    def _write_report(self) -> None:
        """Write report.json after all other records, with those that were lost."""
        if self._report is None or self._folder is None or self._is_reported:
            return
        self._is_reported = True
        try:
            self._folder.write_report(self._with_losses(self._report).plain())
        except OSError as error:
            self._telemetry.lose("report.json", reason_of(error))
        self._report = self._with_losses(self._report)

    def _with_losses(self, report: Report) -> Report:
        return replace(report, records_lost=[asdict(lost) for lost in self._telemetry.lost])

    @contextmanager
    def _ends_on_error(self) -> Iterator[None]:
        """Stop the robot and end the mission when an error is raised.

        A robot that has failed is not stepped any more. The error may come before the step commands
        the robot, and again in each step that should slow it down.
        """
        runtime = self.engine.runtime
        stopping = runtime.state.is_over
        try:
            yield
        except Exception as error:
            self._stop_robot()
            if not isinstance(error, BodyError):
                self._log(traceback.format_exc())
            if stopping or isinstance(error, BodyError | WorkerError):
                self._steps_to_stop = 0
            runtime.end(MissionState.ERROR, _sentence_of(error))

    @contextmanager
    def _reports_failure(self) -> Iterator[None]:
        """Write a report when a run whose folder exists cannot begin."""
        if self._folder is None:
            yield
            return
        self._watch.prepared(self._unstarted)
        try:
            yield
        except Exception as error:
            reason = str(error) if isinstance(error, TreepilotError) else exception_sentence(error)
            with suppress(OSError):  # the error itself is raised
                self._folder.write_report(replace(self._unstarted, reason=reason).plain())
            raise

    def _refuse_plugin(self, error: BaseException) -> None:
        """Raise InputError for an exception of a plugin before the first step."""
        if isinstance(error, TreepilotError) or not plugin_line(error):
            return
        what = "a plugin failed at the start"
        self._log(traceback_text(what, error))
        log = f"; traceback: {self._folder.path / 'log.txt'}" if self._folder else ""
        raise InputError(f"{what}: {exception_sentence(error)}{log}") from error

    def _show(self, line: str) -> None:
        """Write a line to the run's log and to stderr, where also a caller's notebook shows it."""
        self._log(line)
        print(line, file=sys.stderr, flush=True)

    def _reload_on_change(self) -> None:
        from missions.execution.reload import Reloader

        try:
            reloader = Reloader(self.engine, self._plan, self._options, self._folder)
        except BaseException:
            self.close()
            raise
        self.engine.between_steps = reloader.poll

    def _after_step(self) -> None:
        runtime, body = self.engine.runtime, self.engine.body
        if not self._first_tick:
            self._first_tick = perf_counter()
        if self._kept is not None:
            self._kept.follow(self.engine.tree, body.time, self._telemetry.lose)
        if self._telemetry.lost and self._options.on_lost_records == "stop":
            lost = "; ".join(record.text for record in self._telemetry.lost)
            runtime.end(MissionState.ABORTED, f"records lost: {lost}")
        elif self._recording_ended:
            runtime.end(MissionState.INTERRUPTED, "the recording is over")
        elif body.time > MAX_SIMULATED_SECONDS:
            runtime.end(MissionState.FAILURE, "TIMED_OUT: ran for 24 hours of robot time")


def _sentence_of(error: Exception) -> str:
    """Return the reason of a mission that an error ends."""
    if isinstance(error, BodyError):
        return f"robot failed: {error}"
    return str(error) if isinstance(error, WorkerError) else exception_sentence(error)
