"""`run --watch`: reload the mission when its file changes, while the robot runs.

A file with errors is rejected: every finding is reported and the current tree continues. A valid
file is compiled, the current tree is halted, and the new tree starts from its root once the robot
has stopped. Blackboard values are kept where both files declare the key with the same type;
arguments from `--set` are kept; parameters of components take effect as in live tuning. World,
robot, map, start, faults and the choice of components change only with the next run.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from missions.execution.build import Engine, announce_tree, tree_emitter
from missions.execution.file_watcher import FileWatch
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.resources import WORLDS
from missions.trees.compiler import compile_mission
from missions.trees.mission_tree import MissionTree
from robots.load import find_robot
from stack.documents import Finding
from stack.errors import InputError, ParameterError, TreepilotError
from stack.parameters import values_of
from stack.runtime.mission_state import MissionEvent
from stack.sim.worlds.world_file import find_world
from stack.telemetry.hub import discard
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import MissionState

TUNED = {"costmap": ("local_costmap", "global_costmap")}
"""Kind of component -> its names in live tuning, if it is not called as its kind."""


class Reloader:
    """Reloads a running mission when one of its files changes.

    Attributes:
        plan: the newest accepted mission. Its tree starts once the robot has stopped; its world,
            robot, map, start and components apply to the next run only.
    """

    def __init__(
        self, engine: Engine, plan: PreparedMission, options: RunOptions, folder: RunFolder | None,
        files: FileWatch | None = None,
    ) -> None:  # fmt: skip
        self.plan = self._in_force = plan
        self._engine, self._folder = engine, folder
        self._log: Callable[[str], None] = folder.log if folder is not None else discard
        self._telemetry = engine.telemetry
        self._options = _pinned(plan, options)
        self._files = files or FileWatch([])
        self._files.watch(plan.files)

    def poll(self) -> None:
        """Reload the files that changed since the last call; called between two steps."""
        changed = self._files.changed()
        if not changed or self._engine.runtime.state.is_over:
            return
        runtime = self._engine.runtime
        self._telemetry.advance(runtime.steps, runtime.parts.body.time)
        try:
            plan = self._prepared()
            tree = compile_mission(plan.mission)
            tree.setup(runtime.parts.robot, tree_emitter(self._telemetry), self._log)
        except TreepilotError as error:
            self._refuse(error)
        except Exception as error:  # an error in an edited file must not end the running mission
            self._log(traceback.format_exc())
            self._refuse(InputError(f"{type(error).__name__}: {error}"))
        else:
            self._accept(plan, tree, changed)

    def _prepared(self) -> PreparedMission:
        source = self.plan.mission.source
        if not source.is_file():
            raise InputError(f"{source.name} was deleted; save it again")
        return prepare(source, self._options)

    def _refuse(self, error: TreepilotError) -> None:
        findings = error.findings if isinstance(error, InputError) else ()
        faults = [_shown(finding) for finding in findings] or [str(error)]
        self._engine.debugger.faults = tuple(faults)
        count = f"{len(faults)} finding{'' if len(faults) == 1 else 's'}"
        self._telemetry.emit(
            "reload_refused", f"saved mission rejected, the current one continues: {count}",
            source="mission", level="error", findings=faults,
        )  # fmt: skip
        for fault in faults:
            self._telemetry.emit("finding", fault, source="mission", level="error")
        faulty = [Path(finding.mark.file) for finding in findings]
        self._files.watch([*self.plan.files, *(file for file in faulty if file.is_file())])

    def _accept(self, plan: PreparedMission, tree: MissionTree, changed: list[Path]) -> None:
        """Halt the current tree; `_switch` follows when the robot has stopped."""
        self._engine.debugger.faults = ()
        names = sorted({file.name for file in changed})
        self._telemetry.emit(
            "saved", f"{', '.join(names)} saved: halting the tree to reload it", source="mission",
            files=names, sha256=sha256(plan.text.encode()).hexdigest(),
        )  # fmt: skip
        known = (*self.plan.mission.warnings, *self.plan.warnings)
        for warning in (*plan.mission.warnings, *plan.warnings):
            if warning not in known:
                self._telemetry.emit("finding", _shown(warning), source="mission", level="warning")
        self.plan = plan
        self._files.watch(plan.files)
        self._engine.runtime.replace_tree(lambda: self._switch(plan, tree))

    def _switch(self, plan: PreparedMission, tree: MissionTree) -> MissionTree:
        engine, debugger = self._engine, self._engine.debugger
        former, self._in_force = self._in_force, plan  # a file saved in between was never in force
        kept = tree.inherit(engine.tree)
        lost = debugger.move_to(tree)
        debugger.generation += 1
        if engine.runtime.state is MissionState.PAUSED:
            engine.runtime.mission.send(
                MissionEvent.PAUSE, "the mission was reloaded; step or continue"
            )
        later = [*_for_next_run(former, plan), *self._tune(former, plan)]
        parts = [f"tree {debugger.generation + 1} starts from its root"]
        parts += [f"kept {', '.join(kept)}"] if kept else []
        parts += [f"takes effect at the next run: {', '.join(later)}"] if later else []
        parts += [f"breakpoint or forced outcome removed, no node at {path}" for path in lost]
        engine.telemetry.emit(
            "reload", "; ".join(parts), source="mission",
            level="warning" if later or lost else "info", generation=debugger.generation,
            kept=kept, next_run=later, lost=lost,
        )  # fmt: skip
        announce_tree(engine.telemetry, tree)
        self._keep_text(plan.text, debugger.generation)
        engine.tree = tree
        return tree

    def _tune(self, former: PreparedMission, plan: PreparedMission) -> Iterator[str]:
        """Apply changed parameters; yield the names of those that apply to the next run only."""
        tuning = self._engine.runtime.parts.live_parameters
        for kind, choice in plan.choices.items():
            before = former.choices[kind]
            if choice.name != before.name:
                yield f"{kind} {choice.name}"
                continue
            if repr(choice.parts) != repr(before.parts):  # reading a plugin creates new classes
                yield f"{kind} layers or zones"
            values = values_of(before.parameters)
            for parameter, value in values_of(choice.parameters).items():
                if value == values[parameter]:
                    continue
                try:
                    for name in TUNED.get(kind, (kind,)):
                        tuning.change(f"{name}.{parameter}", value)
                except ParameterError:
                    yield f"{kind}.{parameter}"

    def _keep_text(self, text: str, generation: int) -> None:
        if self._folder is None:
            return
        try:
            self._folder.write(f"mission-{generation + 1}.yaml", text.encode())
        except OSError as error:
            self._log(f"cannot write the reloaded mission to the run folder: {error}")


def _pinned(plan: PreparedMission, options: RunOptions) -> RunOptions:
    """Return the options for reading the file again, with the current world and robot."""
    folder = plan.mission.source.parent
    world = options.world
    if world is None and plan.mission.world:
        world = str(find_world(plan.mission.world, folder, WORLDS).resolve())
    robot = options.robot or str(find_robot(plan.mission.robot, folder).resolve())
    return replace(options, world=world, robot=robot, breakpoints=(), forced=None)


def _for_next_run(former: PreparedMission, plan: PreparedMission) -> Iterator[str]:
    """Yield changed settings of the mission that apply to the next run only."""
    old, new = former.mission, plan.mission
    settings = {
        "world": (old.world, new.world), "robot": (old.robot, new.robot), "map": (old.map, new.map),
        "initial_pose": (old.initial_pose, new.initial_pose),
    }  # fmt: skip
    for word, (before, after) in settings.items():
        if before != after:
            yield f"{word} {after}"
    if former.start != plan.start:
        yield "start"
    if former.faults != plan.faults:
        yield "faults"


def _shown(finding: Finding) -> str:
    """Return a finding as text with the file's name only: the hashed log holds no paths."""
    mark = replace(finding.mark, file=Path(finding.mark.file).name)
    return str(replace(finding, mark=mark))
