"""`run --watch`: takes a mission anew when its file is saved, while the robot runs.

A file with findings is reported with all of them and the tree in force goes on. A good one is
compiled, the tree in force is halted, and once the robot stands the new one starts from its root.
Values of the blackboard go over where both files declare the key with the same type; arguments
given by `--set` stay; parameters under `navigator` take effect as by live tuning. World, robot,
map, start and the choice of components stay as they are until the next run.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from hashlib import sha256
from pathlib import Path

from behaviours.catalogue import plugin_sources
from missions.execution.build import Engine, announce_tree, tree_emitter
from missions.execution.file_watcher import FileWatch
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.resources import WORLDS
from missions.trees.compiler import compile_mission
from missions.trees.mission_tree import MissionTree
from robots.load import find_robot
from stack.documents import Finding
from stack.errors import InputError, ParameterError, TreepilotError
from stack.sim.worlds.world_file import find_world
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import MissionState

TUNED = {
    "controller": ("controller",), "navigator": ("navigator",), "safety": ("safety",),
    "costmap": ("local_costmap", "global_costmap"), "planner": (),
}  # fmt: skip
"""Under what names live tuning knows the kinds of components."""


class Reloader:
    """Looks after the files of a running mission.

    Attributes:
        plan: the newest that was taken, in force once the robot stands; of a mission that was
            reloaded, with what will be so next time.
    """

    def __init__(
        self, engine: Engine, plan: PreparedMission, options: RunOptions, folder: RunFolder | None,
        files: FileWatch | None = None,
    ) -> None:  # fmt: skip
        self.plan = self._in_force = plan
        self._wiring, self._folder = engine, folder
        self._log: Callable[[str], None] = folder.log if folder is not None else _nowhere
        self._telemetry = engine.telemetry
        self._options = _pinned(plan, options)
        self._files = files or FileWatch([])
        self._files.watch(_files_of(plan))

    def look(self) -> None:
        """Take what was saved since the last call; called between two steps."""
        changed = self._files.changed()
        if not changed or self._wiring.runtime.state.is_over:
            return
        runtime = self._wiring.runtime
        self._telemetry.advance(runtime.steps, runtime.parts.body.time)
        try:
            plan = self._prepared()
            tree = compile_mission(plan.mission)
            tree.setup(runtime.parts.facade, tree_emitter(self._telemetry), self._log)
        except TreepilotError as error:
            self._refuse(error)
        except Exception as error:  # the mission in force must not suffer for a file being edited
            self._log(traceback.format_exc())
            self._refuse(InputError(f"{type(error).__name__}: {error}"))
        else:
            self._take(plan, tree, changed)

    def _prepared(self) -> PreparedMission:
        source = self.plan.mission.source
        if not source.is_file():
            raise InputError(f"{source.name} is gone; save it again")
        return prepare(source, self._options)

    def _refuse(self, error: TreepilotError) -> None:
        findings = error.findings if isinstance(error, InputError) else ()
        faults = [_shown(finding) for finding in findings] or [str(error)]
        self._wiring.debugger.faults = tuple(faults)
        count = f"{len(faults)} finding{'' if len(faults) == 1 else 's'}"
        self._telemetry.emit(
            "reload_refused", f"the saved mission is not taken, the old one goes on: {count}",
            source="mission", level="error", findings=faults,
        )  # fmt: skip
        for fault in faults:
            self._telemetry.emit("finding", fault, source="mission", level="error")
        beside = [Path(finding.mark.file) for finding in findings]
        self._files.watch([*_files_of(self.plan), *(file for file in beside if file.is_file())])

    def _take(self, plan: PreparedMission, tree: MissionTree, changed: list[Path]) -> None:
        """Halt the old tree; the rest follows when the robot stands."""
        self._wiring.debugger.faults = ()
        names = sorted({file.name for file in changed})
        self._telemetry.emit(
            "saved", f"{', '.join(names)} saved: the tree halts for a new one", source="mission",
            files=names, sha256=sha256(plan.text.encode()).hexdigest(),
        )  # fmt: skip
        known = (*self.plan.mission.warnings, *self.plan.warnings)
        for warning in (*plan.mission.warnings, *plan.warnings):
            if warning not in known:
                self._telemetry.emit("finding", _shown(warning), source="mission", level="warning")
        self.plan = plan
        self._files.watch(_files_of(plan))
        self._wiring.runtime.replace_tree(lambda: self._take_up(plan, tree))

    def _take_up(self, plan: PreparedMission, tree: MissionTree) -> MissionTree:
        engine, debugger = self._wiring, self._wiring.debugger
        former, self._in_force = self._in_force, plan  # one saved in between never was in force
        kept = tree.inherit(engine.tree)
        lost = debugger.move_to(tree)
        debugger.generation += 1
        if engine.runtime.state is MissionState.PAUSED:
            engine.runtime.reason = "the mission was saved anew; step or continue"
        later = [*_for_next_run(former, plan), *self._tune(former, plan)]
        said = [f"tree {debugger.generation + 1} starts from its root"]
        said += [f"kept {', '.join(kept)}"] if kept else []
        said += [f"takes effect at the next run: {', '.join(later)}"] if later else []
        said += [f"no node any more for the breakpoint or outcome at {path}" for path in lost]
        engine.telemetry.emit(
            "reload", "; ".join(said), source="mission",
            level="warning" if later or lost else "info", generation=debugger.generation,
            kept=kept, next_run=later, lost=lost,
        )  # fmt: skip
        announce_tree(engine.telemetry, tree)
        self._keep_text(plan.text, debugger.generation)
        engine.tree = tree
        return tree

    def _tune(self, former: PreparedMission, plan: PreparedMission) -> Iterator[str]:
        """Put changed parameters in force; the names of those that cannot be while it runs."""
        facade = self._wiring.runtime.parts.facade
        for kind, choice in plan.choices.items():
            before = former.choices[kind]
            if choice.name != before.name:
                yield f"{kind} {choice.name}"
                continue
            if repr(choice.parts) != repr(before.parts):  # a plugin's classes are new each time
                yield f"{kind} layers or zones"
            for item in fields(choice.parameters):
                value = getattr(choice.parameters, item.name)
                if value == getattr(before.parameters, item.name):
                    continue
                try:
                    if not TUNED[kind]:
                        raise ParameterError(item.name, "it cannot be changed while it runs")
                    for name in TUNED[kind]:
                        facade.set_parameter(f"{name}.{item.name}", value)
                except ParameterError:
                    yield f"{kind}.{item.name}"

    def _keep_text(self, text: str, generation: int) -> None:
        if self._folder is None:
            return
        try:
            self._folder.write(f"mission-{generation + 1}.yaml", text.encode())
        except OSError as error:
            self._log(f"the saved mission could not be kept: {error}")


def _pinned(plan: PreparedMission, options: RunOptions) -> RunOptions:
    """The options under which the file is read again: with the world and robot in force."""
    beside = plan.mission.source.parent
    world = options.world or str(find_world(plan.mission.world, beside, WORLDS).resolve())
    robot = options.robot or str(find_robot(plan.mission.robot, beside).resolve())
    return replace(options, world=world, robot=robot, breakpoints=(), forced=None)


def _files_of(plan: PreparedMission) -> list[Path]:
    """The mission's own file, what it includes, its parameter files and those of its plugins."""
    mission, beside = plan.mission, plan.mission.source.parent
    return [
        mission.source, *mission.includes, *(beside / name for name in mission.parameter_files),
        *plugin_sources(mission.plugins, beside),
    ]  # fmt: skip


def _for_next_run(former: PreparedMission, plan: PreparedMission) -> Iterator[str]:
    """What the new file says of things that stay as they are while the robot runs."""
    old, new = former.mission, plan.mission
    for word in ("world", "robot", "map", "initial_pose"):
        if getattr(old, word) != getattr(new, word):
            yield f"{word} {getattr(new, word)}"
    if former.start != plan.start:
        yield "start"


def _shown(finding: Finding) -> str:
    """A finding without the folders of its file: they have no place in the log."""
    mark = replace(finding.mark, file=Path(finding.mark.file).name)
    return str(replace(finding, mark=mark))


def _nowhere(text: str) -> None:
    """Where log lines go without a run folder."""
