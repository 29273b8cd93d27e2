"""Report of a finished run: the content of report.json and of `--json`."""

from __future__ import annotations

import dataclasses
import json
import shlex
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stack.telemetry.lost_records import LostRecord

WRONG_INPUT, INTERNAL_ERROR, INTERRUPTED = 2, 3, 130
EXIT_CODES = {
    "success": 0, "failure": 1, "aborted": 1, "error": INTERNAL_ERROR, "interrupted": INTERRUPTED,
}  # fmt: skip
RECORDS_LOST = 3
"""Exit code of a run whose records are not complete, whatever its outcome."""


def worst_of(codes: Collection[int]) -> int:
    """Return the exit code of several missions: the most serious of theirs."""
    return next((code for code in (INTERNAL_ERROR, INTERRUPTED, 1) if code in codes), 0)


@dataclass(frozen=True)
class Report:
    """Outcome and figures of a run.

    Attributes:
        status: success | failure | aborted | interrupted | error.
        reason: path of nodes from the root to the cause of the failure; empty after a success.
        simulated_seconds: on the robot's clock. wall_seconds: first to last step.
        time_to_first_tick: wall seconds from building the run to its first tick.
        distance_m: driven. This, clearance and localisation error are None for a robot that has no
            wheels.
        min_clearance_m: smallest true distance to any obstacle; measured up to 1.0 m. This and the
            next two are None for a body that is not simulated.
        collisions: contacts while the robot moved; pushed_into: contacts while it stood still.
        localisation_error: mean and max distance between estimate and truth, metres.
        doubt: lost_seconds, for which the robot was lost and might not drive, and obscured_metres,
            driven by odometry at low speed because unmapped things hid the map.
        held: seconds for which the robot `stopped`, or was `slower` than half of what it wanted,
            for a second or longer, by cause: obstacle, person, zone, speed limit, old measurement,
            unseen ground, emergency stop, lost…
        relocalised_by: source of the last relocalisation (marker, lidar, operator), or empty.
        stages: compute time by stage of the loop, wall seconds.
        final_pose: estimate and truth at the end.
        log_sha256: hash of the event log; equal runs have equal hashes.
        folder: the run folder, absolute.
        records_lost: the files of the folder that could not be written: record, time from which
            on it is missing, reason, and for events.jsonl the number of the first missing event.
        links_lost: links to other programs that failed: link, time and reason.
        scans_dropped: by lidar, scans that could not be used: the odometry did not cover them, or a
            newer one was there; empty if all were used.
        fast_loop: timing of the process that holds the hardware: rate, cycles, overruns, lateness
            (median, 99.9 %, worst) and work (mean, worst) in seconds, privileges that it lacks;
            empty without one.
        body_link: of a robot behind a link: messages per second by name (`rates`), setpoints per
            second, round trip (median, 99 %) in seconds, messages missed, losses of the robot;
            empty for other robots.
        people: measures of the drive among people (docs/worlds.md); empty without any.
        format: version of this record; counted up when a key changes its meaning.
    """

    mission: str
    status: str
    reason: str
    seed: int
    robot: str
    world: str
    versions: dict[str, str]
    cpu_features: str
    simulated_seconds: float
    wall_seconds: float
    real_time_factor: float
    time_to_first_tick: float
    ticks: int
    distance_m: float | None
    recoveries: int
    replans: int
    collisions: int | None
    pushed_into: int | None
    min_clearance_m: float | None
    localisation_error: dict[str, float] | None
    relocalised_by: str
    relocalisations: list[dict[str, Any]]
    battery: float
    stages: dict[str, dict[str, Any]]
    final_pose: dict[str, Any]
    blackboard: dict[str, str]
    peak_memory_mb: float
    log_sha256: str
    folder: str
    arguments: dict[str, str]
    records_lost: list[dict[str, Any]] = field(default_factory=list)
    doubt: dict[str, float] = field(default_factory=dict)
    held: dict[str, dict[str, float]] = field(default_factory=dict)
    links_lost: list[dict[str, Any]] = field(default_factory=list)
    people: dict[str, Any] = field(default_factory=dict)
    fast_loop: dict[str, Any] = field(default_factory=dict)
    body_link: dict[str, Any] = field(default_factory=dict)
    scans_dropped: dict[str, int] = field(default_factory=dict)
    format: int = 1

    @property
    def exit_code(self) -> int:
        """Exit code of the process."""
        return RECORDS_LOST if self.records_lost else EXIT_CODES[self.status]

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return dataclasses.asdict(self)

    def to_json(self) -> str:
        """Return one indented JSON object, without NaN or infinity."""
        return json.dumps(self.plain(), indent=2, allow_nan=False, ensure_ascii=False)

    def summary(self) -> str:
        """Return a few lines for the terminal."""
        from stack.types.printable import printable  # imports NumPy, which the command avoids

        error, clearance = self.localisation_error, self.min_clearance_m
        lines = [
            f"{self.mission}: {self.status}" + (f"; {self.reason}" if self.reason else ""),
            f"  {self.simulated_seconds:.1f} s simulated in {self.wall_seconds:.1f} s"
            f" ({self.real_time_factor:.1f} x real time),"
            + ("" if self.distance_m is None else f" {self.distance_m:.1f} m driven,")
            + f" seed {self.seed}",
            f"  recoveries {self.recoveries}, replans {self.replans}"
            + ("" if self.collisions is None else f", collisions {self.collisions}")
            + ("" if clearance is None else f", clearance {clearance:.2f} m")
            + (
                f", localisation error {error['mean']:.3f} m (max {error['max']:.3f} m)"
                if error
                else ""
            ),
        ]
        if any(self.doubt.values()):
            lines.append(
                f"  lost for {self.doubt['lost_seconds']:.1f} s, "
                f"{self.doubt['obscured_metres']:.1f} m by odometry past unmapped things"
            )
        if stopped := self.held.get("stopped"):
            causes = ", ".join(f"{cause} {seconds:.1f} s" for cause, seconds in stopped.items())
            lines.append(f"  held by: {causes}")
        if self.scans_dropped:
            counts = ", ".join(f"{count} of {name}" for name, count in self.scans_dropped.items())
            lines.append(f"  scans that could not be used: {counts}")
        if self.relocalised_by:
            lines.append(f"  relocalised by {self.relocalised_by}")
        lines.append(f"  event log {self.log_sha256[:16]}")
        if self.folder:
            folder = Path(self.folder)
            lines.append(f"  records in {_shown(folder)}")
        for link in self.links_lost:
            lines.append(f"  {link['link']} lost at {link['time']:.1f} s ({link['reason']})")
        for lost in self.records_lost:
            lines.append(f"  records lost: {LostRecord(**lost).text}")
        return printable("\n".join(lines))


def read_report(folder: Path) -> Report | None:
    """Return the report in a run folder; None if there is none, or it lacks fields."""
    try:
        return Report(**(read_fields(folder) or {}))
    except TypeError:
        return None


def read_fields(folder: Path) -> dict[str, Any] | None:
    """Return what can be read of the report in a run folder; None if there is none.

    Another version may have written more fields, which are left out; fewer; or others with the same
    names, which are left out too.
    """
    from stack.documents.files import JSON_BYTES, read_bytes  # not for every start of the command
    from stack.telemetry.codec import MalformedError, field_codecs  # as above

    try:
        content = json.loads(read_bytes(folder / "report.json", JSON_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(content, dict):
        return None
    known = {}
    for name, codec in field_codecs(Report).items():
        with suppress(LookupError, MalformedError):
            known[name] = codec.decode(content[name])
    return known


def _shown(path: Path) -> str:
    """A path as short as it can be typed in this folder, and quoted if the shell needs it."""
    here = Path.cwd()
    return shlex.quote(str(path.relative_to(here) if path.is_relative_to(here) else path))
