"""Options of a run, for the command line, the engine, `missions.run` and benches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from stack.telemetry.records import Command


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, as `treepilot run` takes them.

    Attributes:
        speed: simulated seconds per wall second; 0 is as fast as possible.
        out: the run folder, made absolute; None writes no records.
        serve: let dashboards attach.
        mavlink: address of a MAVLink ground station, or None.
        mavlink_key: file with the key of a signed MAVLink link.
        mavlink_home: `auto`, `always` or `never`: whether the first item of a plan is home.
        origin: latitude and longitude of the map's origin, degrees: `48.1374,11.5755`; None: that
            of the world file.
        foxglove: port on the loopback device on which Foxglove can watch, or None.
        parameters: `controller.cruise_speed` -> value as text; overrides all files. Those of faults
            are `fault.NAME.share`, `fault.NAME.at`, `fault.NAME.for`.
        faults: instead of those of mission and world: names of kinds or of files, joined by `+`;
            `none`; None: those of mission and world.
        camera: "asked" renders an image only when the mission asks for one; "off" simulates a
            robot without a working camera; "on" renders all the time, for the recording.
        renderer: tiny | gl | auto, of all cameras; empty: the choice of the robot file.
        watch: reload the mission when its file changes.
        breakpoints: nodes before which the mission stops.
        forced: node -> outcome, in force from the start.
        body: name of the body; empty: the choice of the robot file.
        replay: sensor log to play instead of driving; its seed replaces `seed`.
        record: what to record besides events: `sensors`.
        on_lost_records: continue | stop, when a record cannot be written, e.g. on a full disk.
        forget_kept: start keys with `keep: true` from their initial values.
        skip_preflight: start a real robot without the checks at standstill.
        identity: of the run, chosen by the process that starts it; empty: a new one.
    """

    seed: int = 0
    arguments: dict[str, str] | None = None
    robot: str | None = None
    world: str | None = None
    start: str | None = None
    out: Path | None = None
    speed: float = 0.0
    serve: bool = True
    mavlink: str | None = None
    mavlink_key: Path | None = None
    mavlink_home: str = "auto"
    origin: str | None = None
    foxglove: int | None = None
    camera: str = "asked"
    renderer: str = ""
    parameters: Mapping[str, str] | None = None
    watch: bool = False
    breakpoints: tuple[str, ...] = ()
    forced: dict[str, str] | None = None
    body: str = ""
    replay: Path | None = None
    record: tuple[str, ...] = ()
    on_lost_records: str = "continue"
    forget_kept: bool = False
    skip_preflight: bool = False
    identity: str = ""
    faults: str | None = None

    def __post_init__(self) -> None:
        if self.out is not None:  # a plugin may change the working directory
            object.__setattr__(self, "out", self.out.absolute())

    def first_commands(self) -> list[Command]:
        """Return the breakpoints and forced outcomes as commands, applied before the first step."""
        stops = [Command("start", "break", {"node": node}) for node in self.breakpoints]
        forced = (self.forced or {}).items()
        return stops + [
            Command("start", "force", {"node": node, "status": outcome}) for node, outcome in forced
        ]
