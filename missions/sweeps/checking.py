"""Checks of a sweep before anything runs: every factor is tried on the mission."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from missions.bench.conditions import digest
from missions.execution.prepare import PreparedMission, prepare
from missions.execution.resources import MISSIONS
from missions.sweeps.design import BY_SCIPY
from missions.sweeps.factors import NORMAL, Factor
from missions.sweeps.sweep import FAULTS, ROBOT, SCENE, START, WORLD, Sweep, check_runs
from robots.bodies import body_kind
from stack.errors import InputError
from stack.optional_packages import SCIPY
from stack.parameters import suggestion

Refusal = Callable[[Factor, InputError], InputError]
"""Returns the error of a factor, with its place."""

FRACTION = 0.3819
"""Where between its ends a distribution is tried: a setting that refuses this is a whole number."""


@dataclass(frozen=True)
class CheckedSweep:
    """A sweep that can run.

    Attributes:
        sweep: with factors of whole numbers as such.
        files: digest of each file that its missions read, by name.
        paths: of these files, absolute.
    """

    sweep: Sweep
    files: dict[str, str]
    paths: tuple[Path, ...] = ()


def checked(sweep: Sweep, refusal: Refusal) -> CheckedSweep:
    """Try the mission as it is, and with each value of each factor, or its ends.

    Combinations are not tried: a run whose combination the mission refuses has that outcome.

    Raises:
        InputError: the mission has errors, a factor is unknown or a value is refused; or a package
            is missing.
    """
    if sweep.design in BY_SCIPY:
        SCIPY.require(f"the design {sweep.design} needs")
    check_runs(sweep)
    plan = _prepared(sweep, {})
    plans = [plan]
    factors = []
    for factor in sweep.factors:
        try:
            _check_name(factor, plan)
            _check_varies(factor, sweep)
            plans += [_tried(sweep, factor, text) for text in factor.probes]
        except InputError as error:
            raise refusal(factor, error) from None
        factors.append(replace(factor, whole=_is_whole(sweep, factor)))
    for one in plans:
        _check_body(one)
    paths = dict.fromkeys(
        file for one in plans for file in (*one.read, *one.files) if file.is_file()
    )  # fmt: skip
    files = {_name(file, plan): digest(file.read_bytes()) for file in paths}
    return CheckedSweep(replace(sweep, factors=tuple(factors)), files, tuple(paths))


def file_differences(before: dict[str, str], now: dict[str, str]) -> Iterable[str]:
    """Yield which files differ, as sentences."""
    for name in {**before, **now}:
        if name not in now:
            yield f"{name} is not read any more"
        elif before.get(name) != now[name]:
            yield f"{name} has changed" if name in before else f"{name} is read now"


def _check_name(factor: Factor, plan: PreparedMission) -> None:
    """Raise InputError for a name that is neither an argument nor that of a component."""
    name = factor.name
    known = [*plan.mission.arguments, *SCENE, FAULTS]
    if "." not in name and name not in known:
        raise InputError(
            f"the mission {plan.mission.source.name} has no argument {name!r}",
            f"{suggestion(name, known)}; parameters of components are KIND.NAME, as `treepilot"
            " parameters` lists them",
        )


def _check_varies(factor: Factor, sweep: Sweep) -> None:
    """Raise InputError for a factor that has one value for all runs as well."""
    scene = {WORLD: sweep.world, ROBOT: sweep.robot, START: sweep.start, FAULTS: sweep.faults}
    fixed = {**sweep.arguments, **sweep.parameters, **scene}.get(factor.name)
    if fixed is not None:
        raise InputError(f"it is also {fixed} for all runs", "leave one out")


def _prepared(sweep: Sweep, settings: Mapping[str, str]) -> PreparedMission:
    return prepare(sweep.mission_of(settings), sweep.options(settings, sweep.seed))


def _tried(sweep: Sweep, factor: Factor, text: str) -> PreparedMission:
    try:
        return _prepared(sweep, {factor.name: text})
    except InputError as error:
        cut = f" (the distribution is cut at 3 deviations: {' to '.join(factor.probes)})"
        where = cut if factor.kind == NORMAL else ""
        raise InputError(f"{text} is refused{where}: {error}") from None


def _is_whole(sweep: Sweep, factor: Factor) -> bool:
    """Whether the mission accepts whole numbers only, and the ends of the distribution are such."""
    if factor.is_list or not all(end.is_integer() for end in factor.ends):
        return False
    low, high = factor.ends
    fraction = f"{low + FRACTION * (high - low)!r} {factor.unit}".rstrip()
    try:
        _prepared(sweep, {factor.name: fraction})
    except InputError:
        return True
    return False


def _check_body(plan: PreparedMission) -> None:
    """Raise InputError for a robot that is not simulated: a sweep would drive a real one."""
    if plan.recording is None and not body_kind(plan.robot.body).simulates:
        raise InputError(
            f"the robot {plan.robot.name} has the body {plan.robot.body}: a sweep runs simulations",
            "choose a simulated robot with --robots, or `body: simulated` in its file",
        )


def _name(file: Path, plan: PreparedMission) -> str:
    """Return the name of a file that is the same on other machines, as far as there is one."""
    for base in (MISSIONS.parent, plan.mission.source.absolute().parent):
        if file.is_relative_to(base):
            return file.relative_to(base).as_posix()
    return str(file)
