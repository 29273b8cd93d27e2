"""The faults of a run: those of mission and world, or those that the options choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from missions.execution.resources import MISSIONS
from missions.execution.scene import OF_SCENE
from missions.language.model import Mission
from missions.run_options import RunOptions
from robots.bodies import body_kind
from stack.documents import Finding, Findings, Mark, Section, read_document
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.parameters import Declaration, suggestion
from stack.sim.faults.planned import PlannedFault
from stack.sim.worlds.world import World
from stack.streams import stream
from stack.types import Pose2D

FAULTS = MISSIONS / "faults"
NONE, SUITE = "none", "suite"
PREFIX = "fault."
"""Of the numbers of faults among the parameters: `fault.NAME.NUMBER`."""

CODE, UNFIT = "E210", "E211"
WHAT = "file of faults"


def fault_files() -> dict[str, Path]:
    """Return the shipped files of faults by name."""
    return {file.stem: file for file in sorted(FAULTS.glob("*.yaml"))}


def component_parameters(parameters: Mapping[str, str] | None) -> dict[str, str]:
    """Return the parameters of components: those that are neither of faults nor of the scene."""
    others = (PREFIX, *OF_SCENE)
    return {k: text for k, text in (parameters or {}).items() if not k.startswith(others)}


def faults_of(
    mission: Mission, world: World, robot: RobotDescription, options: RunOptions, mark: Mark
) -> tuple[PlannedFault, ...]:
    """Return the faults of a run.

    Args:
        mission: with its faults.
        world: with its faults.
        robot: that they befall.
        options: that may choose others, and change their numbers.
        mark: of `faults` in the mission.

    Raises:
        InputError: there is no such fault, a number is wrong, or robot or world lack what it needs.
    """
    numbers = {k: text for k, text in (options.parameters or {}).items() if k.startswith(PREFIX)}
    if options.faults is None and not (mission.faults or world.faults or numbers):
        return ()
    from stack.sim.faults.fault import outside
    from stack.sim.faults.reading import numbered
    from stack.sim.faults.registry import fault_kind

    if options.faults is None:
        chosen = numbered([*mission.faults, *world.faults])
    else:
        chosen = chosen_faults(options.faults, {**world.places, **mission.places})
    faults = _with_numbers(chosen, numbers)
    if faults and not body_kind(options.body or robot.body).simulates:
        raise _refused(f"the body {options.body or robot.body} is not simulated", options, mark)
    for fault in faults:
        never = "" if fault.near is None else outside(world, *fault.near)
        lack = never or fault_kind(fault.kind).lack(fault.parameters, robot, world)
        if lack:
            raise _refused(f"{fault.name}: {lack}", options, mark)
    return faults


def chosen_faults(text: str, places: Mapping[str, Pose2D] | None) -> tuple[PlannedFault, ...]:
    """Return the faults that a text names: files or kinds, joined by `+`, or `none`.

    Args:
        text: as `--faults` has it.
        places: named poses that files may refer to; None: they are not known.

    Raises:
        InputError: there is no such file or kind, or the file has errors.
    """
    from stack.sim.faults.reading import default_fault, numbered
    from stack.sim.faults.registry import fault_names

    if text.strip() in ("", NONE):
        return ()
    found: list[PlannedFault] = []
    for name in filter(None, (part.strip() for part in text.split("+"))):
        file = _file(name)
        if file is not None:
            found += read_fault_file(file, places)
        elif name in fault_names():
            found.append(default_fault(name))
        elif name == NONE:
            raise InputError(f"--faults {text}: `none` stands alone", "leave it out")
        else:
            known = [NONE, *fault_files(), *fault_names()]
            raise InputError(f"--faults: there is no fault {name!r}", suggestion(name, known))
    return numbered(found)


def read_fault_file(
    file: Path, places: Mapping[str, Pose2D] | None, text: str | None = None
) -> tuple[PlannedFault, ...]:
    """Read a file of faults: `doc`, and the list `faults`.

    Args:
        file: to read.
        places: named poses that it may refer to; None: those of a mission that is not known.
        text: of an editor, read instead.

    Raises:
        InputError: it has errors.
    """
    from stack.sim.faults.reading import read_faults

    findings = Findings()
    top = Section(
        read_document(file, WHAT, text), findings, "a file of faults", CODE, ("doc", "faults")
    )
    top.value(Declaration("doc", str, "description", default=""))
    top.node_of("faults", required=True)
    faults = read_faults(top.sequence("faults"), findings, places)
    top.done()
    findings.raise_errors()
    return faults


def _file(name: str) -> Path | None:
    """Return the file of a name or path; None if it is neither."""
    if "/" in name or name.endswith((".yaml", ".yml")):
        return Path(name).expanduser()
    return fault_files().get(name)


def _with_numbers(
    faults: Sequence[PlannedFault], numbers: Mapping[str, str]
) -> tuple[PlannedFault, ...]:
    from stack.documents.reader import value_of
    from stack.sim.faults.reading import changed

    by_name = {fault.name: fault for fault in faults}
    for full, text in numbers.items():
        name, _, number = full.removeprefix(PREFIX).partition(".")
        if name not in by_name:
            hint: str = suggestion(name, by_name) if by_name else "choose faults with --faults"
            raise InputError(f"{full}: this run has no fault {name!r}", hint)
        try:
            by_name[name] = changed(by_name[name], number, value_of(text))
        except ParameterError as error:
            raise InputError(f"{full}: {error}", error.hint) from None
    return tuple(by_name.values())


def _refused(lack: str, options: RunOptions, mark: Mark) -> InputError:
    sentence = f"a fault cannot happen: {lack}"
    if options.faults is not None:
        return InputError(f"--faults {options.faults}: {sentence}")
    return InputError([Finding(mark, UNFIT, sentence, "remove it, or use another robot or world")])


def changes_world(faults: Sequence[PlannedFault]) -> list[PlannedFault]:
    """Return the faults that make a world other than its map."""
    from stack.sim.faults.fault import BEFORE
    from stack.sim.faults.registry import fault_kind

    return [fault for fault in faults if fault_kind(fault.kind).kind == BEFORE]


def world_of(
    world: World, faults: Sequence[PlannedFault], robot: RobotDescription, start: Pose2D, seed: int
) -> World:
    """Return the world in which the robot drives: other than its map, if a fault says so."""
    if not faults:
        return world
    from stack.sim.faults.registry import fault_kind

    for fault in changes_world(faults):
        random = stream(seed, f"fault {fault.name}")
        kind = fault_kind(fault.kind)(fault.parameters, random)
        world = kind.changed_world(world, robot, start)
    return world
