"""`treepilot drive`: drive a robot by keys, and map where it has been."""

import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError

if TYPE_CHECKING:
    from missions.execution.run import Run

MISSION = """\
mission: drive
format: 1
doc: An operator drives the robot by keys{purpose}.
robot: {robot}
world: {world}
{map}run:
  sequence:
    - wait: 2 s
    - assisted_teleop: {{time: 10 h, silence: 10 h}}
{save}"""

LINEAR, ANGULAR, LATERAL = 0.3, 0.8, 0.2
"""Velocities of a key: m/s, rad/s, m/s. One press acts for 0.5 s."""

KEYS = {
    "w": (LINEAR, 0.0, 0.0), "s": (-LINEAR, 0.0, 0.0), "a": (0.0, ANGULAR, 0.0),
    "d": (0.0, -ANGULAR, 0.0), "q": (0.0, 0.0, LATERAL), "e": (0.0, 0.0, -LATERAL),
    "\x1b[A": (LINEAR, 0.0, 0.0), "\x1b[B": (-LINEAR, 0.0, 0.0),
    "\x1b[D": (0.0, ANGULAR, 0.0), "\x1b[C": (0.0, -ANGULAR, 0.0),
}  # fmt: skip
"""Key -> forward m/s, turning rad/s, left m/s."""

DONE = ("\r", "\n", "x")
HELP = "arrows or w a s d: drive   q e: sideways   x or Enter: done   Ctrl+C: abort"


def drive(  # noqa: PLR0913 - each is an option of the command
    robot: Annotated[str, typer.Option(help="robot: a name or a robot.yaml")] = "scout",
    world: Annotated[str, typer.Option(help="world: a name or a file")] = "six_rooms",
    map_: Annotated[
        bool, typer.Option("--map", help="start without a map, and save the one that is drawn")
    ] = False,
    plain: Annotated[
        bool, typer.Option("--plain", help="read keys in this terminal, open no dashboard")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="run folder [default: runs/drive-<time>]")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="random seed")] = 0,
) -> None:
    """Drive a robot by keys, and map with it.

    In the dashboard these are the arrows; --plain is for other terminals. With --map the robot
    knows nothing about the place, and the map is saved in the folder `map` of the run folder at the
    end. Safety limits every velocity.
    """
    if not on_a_terminal():
        raise InputError("drive needs a terminal with a keyboard")
    from missions.run_options import RunOptions

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "drive.yaml"
        file.write_text(mission_text(_named(robot), _named(world), mapping=map_), "utf-8")
        if plain:
            raise typer.Exit(_drive_plain(file, seed, out))
        from missions.execution.supervision.launch import LaunchOptions, launch

        options = RunOptions(seed=seed, out=out)
        raise typer.Exit(launch(LaunchOptions((str(file),), options, headless=False)))


def mission_text(robot: str, world: str, *, mapping: bool) -> str:
    """Return the mission of a drive by keys."""
    return MISSION.format(
        robot=robot, world=world,
        purpose=" and maps where it has been" if mapping else "",
        map="map: none\n" if mapping else "",
        save="    - save_map: {path: map}\n" if mapping else "",
    )  # fmt: skip


def velocity_of(key: str) -> dict[str, float] | None:
    """Return the arguments of a `teleop` command for a key; None for other keys."""
    if key not in KEYS:
        return None
    linear, angular, lateral = KEYS[key]
    wanted = {"linear": linear, "angular": angular, "lateral": lateral}
    return {name: value for name, value in wanted.items() if value}


def keys_in(text: str) -> list[str]:
    """Return the keys in what a terminal has sent: characters, and escape sequences of arrows."""
    found, at = [], 0
    while at < len(text):
        size = 3 if text.startswith("\x1b[", at) else 1
        found.append(text[at : at + size])
        at += size
    return found


def _named(name: str) -> str:
    """Return a path made absolute: the mission is in another folder; a name stays."""
    is_path = "/" in name or Path(name).suffix in (".yaml", ".world", ".sdf")
    return str(Path(name).expanduser().absolute()) if is_path else name


def _drive_plain(file: Path, seed: int, out: Path | None) -> int:
    """Run the mission in this process; keys are read between two steps."""
    from missions.execution.prepare import prepare
    from missions.execution.progress import ProgressLines
    from missions.execution.records.run_folders import RUNS, reserved_suffix
    from missions.execution.run import Run
    from missions.run_options import RunOptions

    with reserved_suffix(["drive"]) as suffix, _raw_keys() as read:
        options = RunOptions(seed=seed, out=out or RUNS / f"drive{suffix}", speed=1.0, serve=False)
        run = Run(prepare(file, options), options, [ProgressLines(typer.echo)])
        typer.echo(HELP)
        try:
            _steps(run, read)
            run.finish()
        finally:
            run.close()
    typer.echo(run.report.summary())
    return run.report.exit_code


def _steps(run: "Run", read: Callable[[], str]) -> None:
    """Step the run to its end; the keys take effect between two steps."""
    while not run.is_over:
        try:
            if run.is_ready():
                run.step()
            else:
                run.serve()
            for key in keys_in(read()):
                press(run, key)
        except KeyboardInterrupt:
            run.interrupt("stopped by the operator")


def press(run: "Run", key: str) -> None:
    """Carry out a key."""
    from stack.telemetry.records import Command

    velocity = velocity_of(key)
    if velocity is not None:
        run.engine.runtime.apply(Command("key", "teleop", velocity))
    elif key in DONE:
        run.engine.runtime.apply(Command("key", "teleop_done", {}))


@contextmanager
def _raw_keys() -> Iterator[Callable[[], str]]:
    """Read keys without waiting for Enter; the terminal is restored at the end."""
    import os
    import select
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)

    def read() -> str:
        ready = select.select([number], [], [], 0.0)[0]
        return os.read(number, 64).decode("utf-8", "replace") if ready else ""

    try:
        tty.setcbreak(number)
        yield read
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)
