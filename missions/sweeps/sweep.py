"""A sweep: a mission, what varies, and how often it runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from glob import glob
from pathlib import Path
from typing import Any

from missions.execution.prepare import RunOptions
from missions.execution.resources import world_files
from missions.sweeps.design import GRID, LATIN, RANDOM, Design, RunDescription
from missions.sweeps.factors import Factor, listed
from stack.errors import InputError
from stack.telemetry.codec import field_codecs

MISSION, WORLD, ROBOT, START, FAULTS = "mission", "world", "robot", "start", "faults"
SCENE = (MISSION, WORLD, ROBOT, START)
"""Factors that are neither arguments nor parameters; `faults` is another one."""

ALL, FAILURES, NONE = "all", "failures", "none"
KEEP = (ALL, FAILURES, NONE)
"""Runs whose folders are kept."""

LARGEST_SEED = 2**63 - 1
"""Of the table."""

TIME_LIMIT = 3600.0
"""Simulated seconds after which a run has failed."""


@dataclass(frozen=True)
class Sweep:
    """Runs of a mission, all of which follow from this and their number.

    Attributes:
        mission: path or name; the first one, if it is a factor.
        runs: number of runs.
        design: grid | random | latin | sobol.
        factors: what varies.
        seed: of the first run.
        arguments: of the mission, and parameters: of its components, the same for all runs.
        robot, world, start, faults: as options of a run; None: the mission's.
        time_limit: simulated seconds.
        keep: all | failures | none.
    """

    mission: str
    runs: int
    design: str
    factors: tuple[Factor, ...] = ()
    seed: int = 0
    arguments: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)
    robot: str | None = None
    world: str | None = None
    start: str | None = None
    faults: str | None = None
    time_limit: float = TIME_LIMIT
    keep: str = FAILURES

    @property
    def plan(self) -> Design:
        """The design of the runs."""
        return Design(self.design, self.factors, self.seed, self.runs)

    def descriptions(self) -> Iterator[RunDescription]:
        """Yield all runs."""
        plan = self.plan
        return (plan.run(number) for number in range(self.runs))

    def mission_of(self, settings: Mapping[str, str]) -> str:
        """Return the mission of a run: path or name."""
        return settings.get(MISSION, self.mission)

    def options(self, settings: Mapping[str, str], seed: int) -> RunOptions:
        """Return the options of a run: as those of `treepilot run`."""
        named = {name: settings.get(name, given) for name, given in (
            (WORLD, self.world), (ROBOT, self.robot), (START, self.start), (FAULTS, self.faults)
        )}  # fmt: skip
        start = named[START]
        rest = {name: text for name, text in settings.items() if name not in (*SCENE, FAULTS)}
        dotted = {name: text for name, text in rest.items() if "." in name}
        plain = {name: text for name, text in rest.items() if "." not in name}
        return RunOptions(
            seed=seed, serve=False, forget_kept=True, robot=named[ROBOT], world=named[WORLD],
            start=start and start.strip("[]"), faults=named[FAULTS],
            arguments={**self.arguments, **plain},
            parameters={**self.parameters, **dotted},
        )  # fmt: skip

    def plain(self) -> dict[str, Any]:
        """Return what the results depend on, as JSON has it."""
        values = {
            name: codec.encode(getattr(self, name))
            for name, codec in field_codecs(Sweep).items()
            if name not in ("factors", "keep")
        }
        return {**values, "factors": [factor.plain() for factor in self.factors]}

    @classmethod
    def read(cls, plain: Mapping[str, Any]) -> Sweep:
        """Return a sweep from the values of its JSON.

        Raises:
            LookupError, TypeError, MalformedError: they are not those of a sweep.
        """
        codecs = field_codecs(Sweep).items()
        values = {name: codec.decode(plain[name]) for name, codec in codecs if name != "factors"}
        return cls(**values, factors=tuple(map(Factor.read, plain["factors"])))

    @property
    def may_grow(self) -> bool:
        """Whether more runs leave those before them as they are."""
        return self.design != LATIN or not self.factors

    def differences(self, other: Sweep) -> Iterator[str]:
        """Yield in what two sweeps differ, as sentences; keep and number of runs may differ.

        The path of the mission may differ too: digests tell whether it is the same file.
        """
        before, now = other.plain(), self.plain()
        for plain in (before, now):
            plain["mission"] = Path(plain["mission"]).stem
        factors = ({one["name"]: one for one in plain.pop("factors")} for plain in (before, now))
        old, new = factors
        if self.may_grow:
            before.pop("runs"), now.pop("runs")
        for name in now:
            if before[name] != now[name]:
                yield f"{name} was {_shown(before[name])}, is {_shown(now[name])}"
        for name in {**old, **new}:
            if old.get(name) != new.get(name):
                was, now_is = (_factor_shown(one.get(name)) for one in (old, new))
                yield f"the factor {name} was {was}, is {now_is}"
        if [*old] != [*new] and {*old} == {*new}:
            yield f"the factors were in the order {', '.join(old)}, are in {', '.join(new)}"


def with_choices(sweep: Sweep, worlds: str | None, robots: tuple[str, ...] | None) -> Sweep:
    """Return the sweep with worlds and robots as factors.

    Args:
        sweep: without them.
        worlds: a pattern of files, or of names of shipped worlds; None: the mission's.
        robots: names or files; None: the mission's.

    Raises:
        InputError: there is no such world, there are none, or a factor is given twice.
    """
    more = [] if worlds is None else [_choice(WORLD, _worlds(worlds))]
    more += [] if robots is None else [_choice(ROBOT, robots)]
    factors = (*sweep.factors, *more)
    names = [factor.name for factor in factors]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"the factor {twice} is given twice")
    return replace(sweep, factors=factors)


def _choice(name: str, values: Sequence[str]) -> Factor:
    try:
        return listed(name, values)
    except InputError as error:
        raise InputError(f"{name}s: {error}") from None


def check_runs(sweep: Sweep) -> None:
    """Raise InputError if a grid has no values, or too few runs, or if seeds are too large."""
    if sweep.seed + sweep.runs > LARGEST_SEED:
        raise InputError(f"seed {sweep.seed} and {sweep.runs} runs: the largest seed is 2**63 - 1")
    if sweep.design != GRID:
        return
    drawn = next((factor for factor in sweep.factors if not factor.is_list), None)
    if drawn is not None:
        raise InputError(
            f"a grid needs lists of values, but {drawn.name} is {drawn.kind}",
            "use --design random, or list its values",
        )
    if sweep.plan.combinations > sweep.runs:
        raise InputError(
            f"the grid has {sweep.plan.combinations} combinations, but only {sweep.runs} runs",
            f"use --runs {sweep.plan.combinations} or more, or --design random",
        )


def check_claim(sweep: Sweep) -> None:
    """Raise InputError if the runs, in the order of their numbers, are no random sample."""
    if sweep.design != RANDOM:
        raise InputError(
            f"--until needs runs that are drawn independently, but the design is {sweep.design}",
            "use --design random, or judge all runs by --fail-if",
        )


def _worlds(pattern: str) -> list[str]:
    """Return the files that a pattern names, else the shipped worlds."""
    files = sorted({Path(name) for name in glob(pattern, recursive=True)})
    found = [str(file) for file in files if file.is_file()] or [
        file.stem for file in world_files() if fnmatch(file.stem, pattern)
    ]
    if not found:
        raise InputError(
            f"no world file matches {pattern!r}",
            "quote it: --worlds 'worlds/*.yaml'; `treepilot list worlds` lists shipped ones",
        )
    return found


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return " ".join(f"{name}={text}" for name, text in value.items()) or "none"
    return "the mission's" if value is None else str(value)


def _factor_shown(plain: Mapping[str, Any] | None) -> str:
    if plain is None:
        return "not there"
    if plain["values"]:
        return ",".join(plain["values"])
    return f"{plain['kind']}({plain['low']:g}, {plain['high']:g}) {plain['unit']}".rstrip()
