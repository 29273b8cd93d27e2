"""Figures of one run of a sweep: a line of the journal, and a row of the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from missions.sweeps.design import RunDescription
from missions.sweeps.factors import Factor
from stack.telemetry.codec import from_plain, plain_fields

SUCCESS, FAILURE, TIME_LIMIT = "success", "failure", "time limit"
CRASHED, HUNG, KILLED, REFUSED = "crashed", "hung", "killed", "refused"

OUTCOMES = (SUCCESS, FAILURE, TIME_LIMIT, "aborted", CRASHED, HUNG, KILLED, REFUSED)
"""What can become of a run. `refused`: the mission does not accept this combination of settings;
such a run is no failure of the robot, and rates leave it out."""

COSTS = ("real_time_factor", "wall_seconds", "start_seconds", "cpu_seconds", "memory_mb")
"""Figures of what a run cost; all others are the same in each process and on each machine."""

DRIVING = ("detour", "turning", "jerk", "goal_error")
"""Figures that only tunings ask for: each step is recorded for them."""


@dataclass(frozen=True, slots=True)
class SweepRow:
    """A run that is over. Figures that it does not have are None.

    Attributes:
        number, seed: of the run.
        settings: values of the factors, as text.
        outcome: one of OUTCOMES.
        code: of the failure; node: whose failure ended the mission; reason: for people.
        cause: the likeliest, as `treepilot diagnose` names it; empty if the records show none.
        seconds: simulated. distance: driven, metres.
        clearance: smallest true distance to any obstacle, metres, measured up to 1 m.
        collisions: contacts while the robot moved; pushed_into: while it stood.
        error_mean, error_max: distance between estimate and truth, metres.
        end_x, end_y: true position at the end, metres.
        real_time_factor: simulated seconds per wall second.
        wall_seconds: of the whole run, with start and diagnosis; start_seconds: to the first step.
        cpu_seconds: processor time of the process. memory_mb: of the process after the run.
        detour: driven distance per metre of the shortest path through the reached goals. turning:
            mean absolute change of the commanded angular velocity, rad/s². jerk: root mean square
            of the commanded jerk, m/s³. goal_error: mean true distance to the goals when they were
            reported reached, metres. None unless they were asked for.
        event_hash: of the event log; equal runs have equal hashes.
        is_repeatable: whether the repetition for the records had the same hash; None without one.
        folder: of the kept run, relative to the sweep's; empty if it is not kept.
        versions: of treepilot and the libraries that results depend on.
    """

    number: int
    seed: int
    settings: Mapping[str, str]
    outcome: str
    code: str = ""
    node: str = ""
    reason: str = ""
    cause: str = ""
    seconds: float | None = None
    distance: float | None = None
    clearance: float | None = None
    collisions: int | None = None
    pushed_into: int | None = None
    error_mean: float | None = None
    error_max: float | None = None
    recoveries: int | None = None
    replans: int | None = None
    end_x: float | None = None
    end_y: float | None = None
    real_time_factor: float | None = None
    wall_seconds: float | None = None
    start_seconds: float | None = None
    cpu_seconds: float | None = None
    memory_mb: float | None = None
    detour: float | None = None
    turning: float | None = None
    jerk: float | None = None
    goal_error: float | None = None
    event_hash: str = ""
    is_repeatable: bool | None = None
    folder: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_success(self) -> bool:
        """Whether the mission succeeded."""
        return self.outcome == SUCCESS

    @property
    def counts(self) -> bool:
        """Whether the run counts in rates."""
        return self.outcome != REFUSED

    @property
    def without_costs(self) -> SweepRow:
        """The row without the figures that differ between two runs that are the same."""
        nothing: Any = dict.fromkeys(COSTS)
        return replace(self, **nothing)

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return plain_fields(self)

    @classmethod
    def read(cls, plain: Mapping[str, Any]) -> SweepRow:
        """Return a row from the values of its JSON.

        Raises:
            LookupError, TypeError, MalformedError: they are not those of a row.
        """
        return from_plain(cls, plain)

    @classmethod
    def without_figures(
        cls, run: RunDescription, outcome: str, reason: str, versions: Mapping[str, str]
    ) -> SweepRow:
        """Return the row of a run that did not come to its end."""
        return cls(
            run.number, run.seed, dict(run.settings), outcome, reason=reason, versions=versions
        )


def counted(rows: Sequence[SweepRow]) -> tuple[int, int]:
    """Return the number of successes, and of runs that count."""
    counting = [row for row in rows if row.counts]
    return sum(row.is_success for row in counting), len(counting)


def columns(rows: Sequence[SweepRow], factors: Sequence[Factor]) -> dict[str, list[Any]]:
    """Return the columns of a table: number, seed, the factors by name, then the figures.

    A run without a value of a factor, the baseline of a tuning, has None.
    """
    measured = any(row.jerk is not None for row in rows)
    left_out = ("settings", "versions", *(() if measured else DRIVING))
    names = [item.name for item in fields(SweepRow) if item.name not in left_out]
    named = {
        f"argument.{factor.name}" if factor.name in names else factor.name: [
            factor.typed(row.settings[factor.name]) if factor.name in row.settings else None
            for row in rows
        ]
        for factor in factors
    }
    figures = {name: [getattr(row, name) for row in rows] for name in names}
    versions = [" ".join(f"{name}={text}" for name, text in row.versions.items()) for row in rows]
    first = {name: figures.pop(name) for name in ("number", "seed")}
    return {**first, **named, **figures, "versions": versions}
