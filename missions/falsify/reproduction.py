"""A mission file with the settings that break it.

Its folder needs whatever the mission names beside itself. If there is no such thing, the file
stands beside the table; else beside the copies in the folder of the run that broke.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

from missions.execution.component_choices import NAVIGATION_KINDS
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.records.inputs import read_inputs
from missions.execution.report import Report
from missions.execution.running import execute
from missions.execution.scene import PERSON, START_NUMBER
from missions.sweeps.sweep import Sweep
from stack.documents import read_file
from stack.documents.rewriting import with_values
from stack.errors import InputError
from stack.parameters import values_of
from stack.sim.faults.fault import BEFORE
from stack.sim.faults.planned import PlannedFault
from stack.sim.faults.registry import fault_kind
from stack.types import Pose2D

FILE, WORLD_FILE, RUN = "falsified.yaml", "falsified_world.yaml", "falsified"


def write_reproduction(
    sweep: Sweep, settings: Mapping[str, str], folder: Path, heading: str
) -> tuple[Path, Report]:
    """Write the mission with the settings of a run in it, and run it.

    Args:
        sweep: whose mission it is.
        settings: of the run.
        folder: of the table.
        heading: comment above the mission, a line.

    Returns:
        The file, and the report of its run.

    Raises:
        InputError: the mission cannot be written as one file.
    """
    options, run = sweep.options(settings, sweep.seed), _unused(folder / RUN)
    plan = prepare(sweep.mission, options)
    plain = RunOptions(seed=sweep.seed, serve=False, forget_kept=True)
    file = _written(plan, options, folder, heading)
    try:
        return file, execute(prepare(file, plain), replace(plain, out=run))
    except InputError:  # it names files beside itself
        file.unlink()
    execute(plan, replace(options, out=run))
    file = _written(plan, options, read_inputs(run).mission.parent, heading)
    return file, execute(prepare(file, plain), plain)


def _written(plan: PreparedMission, options: RunOptions, folder: Path, heading: str) -> Path:
    """Write the mission, and its world if the options change people; return the mission's file."""
    if any(_people(options)):
        (folder / WORLD_FILE).write_text(_world(plan, options), "utf-8")
    file = folder / FILE
    file.write_text(f"# {heading}\n{_rewritten(plan, options)}", "utf-8")
    return file


def _unused(path: Path) -> Path:
    number, found = 1, path
    while found.exists():
        number += 1
        found = path.with_name(f"{path.name}_{number}")
    return found


def _rewritten(plan: PreparedMission, options: RunOptions) -> str:
    """Return the text of a mission with all that the options set."""
    values: dict[tuple[str, ...], str] = {}
    if options.robot is not None:
        values["robot",] = json.dumps(str(options.robot))
    if any(_people(options)):
        values["world",] = f"./{WORLD_FILE}"
    elif options.world is not None:
        values["world",] = json.dumps(str(options.world))
    if options.start is not None or _has(options, START_NUMBER):
        values["start",] = _pose(plan.start)
    for name, text in (options.arguments or {}).items():
        values["arguments", name, "default"] = text
    text = plan.text
    for path, value in {**values, **_components(plan, options)}.items():
        try:
            text = with_values(text, {path: value})
        except ValueError:  # `controller: mppi`, a name where a mapping is needed
            used = plan.choices[path[-2]].name
            text = with_values(text, {path[:-1]: f"{{use: {used}, {path[-1]}: {value}}}"})
    faults = ", ".join(map(_fault, plan.faults))
    return with_values(text, {("faults",): f"[{faults}]"}) if plan.faults else text


def _components(plan: PreparedMission, options: RunOptions) -> dict[tuple[str, ...], str]:
    """Return the parameters of components by their paths in a mission; `use` comes first."""
    dotted = [
        (name.partition("."), text) for name, text in (options.parameters or {}).items()
        if not name.startswith((START_NUMBER, PERSON, "fault."))
    ]  # fmt: skip
    dotted.sort(key=lambda item: item[0][2] != "use")
    return {
        (("navigation", kind, name) if kind in NAVIGATION_KINDS else (kind, name)): text
        for (kind, _, name), text in dotted
    }


def _fault(fault: PlannedFault) -> str:
    """Return a fault as missions have it, in SI units."""
    numbers = {name: _plain(value) for name, value in values_of(fault.parameters).items()}
    given = {name: value for name, value in numbers.items() if value is not None}
    words = [f"{fault.kind}: {json.dumps(given)}"]
    at: dict[str, Any] = {"time": fault.time}
    if fault.near is not None:
        at |= {"near": list(fault.near[:2]), "within": fault.near[2]}
    if fault.per_minute:
        at["per_minute"] = fault.per_minute
    if fault_kind(fault.kind).kind != BEFORE:
        words.append(f"at: {json.dumps(at if len(at) > 1 else fault.time)}")
    if isfinite(fault.duration):
        words.append(f"for: {json.dumps(fault.duration)}")
    return "{" + ", ".join(words) + "}"


def _plain(value: Any) -> Any:
    return [value.x, value.y, value.heading] if isinstance(value, Pose2D) else value


def _pose(pose: Pose2D) -> str:
    return f"[{pose.x:.12g}, {pose.y:.12g}, {pose.heading:.12g}]"


def _world(plan: PreparedMission, options: RunOptions) -> str:
    """Return the world file with the people of the options; values are JSON, which is YAML too."""
    source = plan.world.source
    if source is None or source.suffix not in (".yaml", ".yml"):
        raise InputError(f"the people of {plan.world.name} cannot be written to a file")
    content = read_file(source, "world file").plain()
    for name, number, text in _people(options):
        for person in content["people"]:
            if person.get("name") == name:
                person[number] = text
    keys = (f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in content.items())
    return "\n".join([*keys, ""])


def _people(options: RunOptions) -> Iterator[tuple[str, str, Any]]:
    """Yield name, number and value of the people of the options."""
    for full, text in (options.parameters or {}).items():
        if full.startswith(PERSON):
            name, _, number = full.removeprefix(PERSON).rpartition(".")
            try:
                yield name, number, float(text)
            except ValueError:
                yield name, number, text


def _has(options: RunOptions, prefix: str) -> bool:
    return any(name.startswith(prefix) for name in options.parameters or {})
