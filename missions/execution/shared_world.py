"""Run several missions at once: one robot each, all in one simulated world with one clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

from missions.execution.fit.faults import changes_world
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.resources import find_mission
from missions.execution.run import Run, RunWatch
from missions.execution.running import rare_collections, run_in_turns
from robots.bodies import body_kind, sharing
from stack.documents import read_file
from stack.errors import InputError
from stack.geometry.polygons import outline_points, points_inside
from stack.telemetry.sinks import Sink

EDGE_SPACING = 0.02
"""Distance, metres, between the points at which two footprints are compared."""


@dataclass(frozen=True)
class Entry:
    """One mission of several.

    Attributes:
        label: name of the mission, unique among them.
        plan: the checked mission.
        options: its options.
        sinks: consumers of its events and snapshots, in addition to those of the options.
        watch: follows its run.
    """

    label: str
    plan: PreparedMission
    options: RunOptions
    sinks: Sequence[Sink] = ()
    watch: RunWatch | None = None


def prepare_together(
    names: Sequence[str | Path], options: RunOptions, suffix: str = ""
) -> list[Entry]:
    """Read and check missions that run in one world.

    Args:
        names: of the mission files; at least two.
        options: for all. Each mission gets the arguments that it declares, the run folder
            `out/<name of the mission><suffix>`, and a seed of its own: `seed`, `seed + 1`, ….
        suffix: of the names of the run folders.

    Raises:
        InputError: a mission has errors, or they do not fit together. Nothing was started.
    """
    _refuse_options_of_one_mission(options)
    files = [find_mission(name) for name in names]
    given = dict(options.arguments or {})
    declared = [_arguments_of(file) for file in files]
    unknown = given.keys() - set().union(*declared)
    if unknown:
        raise InputError(f"--set {min(unknown)}: none of the missions has this argument")
    entries = []
    for number, label in enumerate(_unique([file.stem + suffix for file in files])):
        own = {name: value for name, value in given.items() if name in declared[number]}
        out = None if options.out is None else options.out / label
        single = replace(options, seed=options.seed + number, arguments=own, out=out, identity="")
        entries.append(Entry(label, prepare(files[number], single), single))
    _check_bodies([entry.plan for entry in entries], options)
    _check_world([entry.plan for entry in entries])
    _check_starts([entry.plan for entry in entries])
    return entries


def run_together(
    entries: Sequence[Entry], interrupted: Callable[[], bool] = lambda: False
) -> list[Report]:
    """Run missions in one world to their ends; return their reports in the same order.

    Each robot steps in turn; time advances once all have stepped. A robot whose mission is over
    stays in the world.

    Args:
        entries: from `prepare_together`.
        interrupted: called between steps; True ends all missions as interrupted.
    """
    from stack.sim.simulation import Simulation  # imports PyBullet

    first = entries[0]
    simulation = Simulation(first.plan.world, pace=first.options.speed)
    runs: list[Run] = []
    with rare_collections(), ExitStack() as cleanup:
        cleanup.callback(simulation.close)
        for entry in entries:
            make_body = sharing(simulation)
            run = Run(entry.plan, entry.options, entry.sinks, make_body, interrupted, entry.watch)
            cleanup.callback(run.close)
            runs.append(run)
        run_in_turns(runs, interrupted)
    return [run.report for run in runs]


def _arguments_of(file: Path) -> set[str]:
    """Return the names of the arguments that a mission file declares."""
    node = read_file(file, "mission").get("arguments")
    return set() if node is None else {str(key.value) for key, _ in node.entries}


def _refuse_options_of_one_mission(options: RunOptions) -> None:
    """Raise InputError for options that make sense for one robot only."""
    given = {
        "--start": options.start is not None,
        "--break": bool(options.breakpoints),
        "--force": bool(options.forced),
        "--watch": options.watch,
        "--replay": options.replay is not None,
        "--mavlink": options.mavlink is not None,
        "--foxglove": options.foxglove is not None,
    }
    for option, is_given in given.items():
        if is_given:
            raise InputError(
                f"{option} is for one mission; with several, leave it out or run them one by one"
            )


def _unique(names: Sequence[str]) -> list[str]:
    """Number repeated names: patrol, patrol-2, …."""
    found: list[str] = []
    for name in names:
        count, candidate = 1, name
        while candidate in found:
            count += 1
            candidate = f"{name}-{count}"
        found.append(candidate)
    return found


def _check_bodies(plans: Sequence[PreparedMission], options: RunOptions) -> None:
    """Raise InputError for a robot whose body is in no simulation."""
    for plan in plans:
        body = options.body or plan.robot.body
        if not body_kind(body).simulates:
            raise InputError(
                f"{plan.mission.source.name}: the body of {plan.robot.name} is {body};"
                " robots in one world must be simulated: add --body simulated"
            )


def _check_world(plans: Sequence[PreparedMission]) -> None:
    """Raise InputError unless all missions are in one world, as its file has it."""
    first = plans[0]
    for plan in plans:
        if changes_world(plan.faults):
            raise InputError(
                f"{plan.mission.source.name} has a fault that changes the world;"
                " robots that run together share it: run them one by one"
            )
    for plan in plans[1:]:
        if (plan.world.source, plan.world.name) != (first.world.source, first.world.name):
            raise InputError(
                f"robots that run together share a world: {first.mission.source.name} is in"
                f" {first.world.name}, {plan.mission.source.name} in {plan.world.name};"
                " choose one with --world"
            )


def _check_starts(plans: Sequence[PreparedMission]) -> None:
    """Raise InputError for robots that would start inside each other."""
    corners = [plan.start.transform(plan.robot.footprint.points) for plan in plans]
    for one, other in combinations(range(len(plans)), 2):
        inside = [
            points_inside(outline_points(corners[a], EDGE_SPACING), corners[b]).any()
            for a, b in ((one, other), (other, one))
        ]
        if any(inside):
            place = plans[other].start
            raise InputError(
                f"{plans[one].mission.source.name} and {plans[other].mission.source.name} start at"
                f" the same place, ({place.x:g}, {place.y:g}); give one another `start`"
            )
