"""`treepilot replay`: the dashboard on a recorded run."""

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError


def replay(
    run: Annotated[
        str, typer.Argument(help="run folder, name of a run in ./runs, or `newest`")
    ] = "newest",
    at: Annotated[
        str, typer.Option("--at", help="begin at this time, paused: 83.5, 1:23 or 1:02:03")
    ] = "",
    speed: Annotated[
        float, typer.Option("--speed", min=0.125, max=64.0, help="robot seconds per second")
    ] = 1.0,
) -> None:
    """Play a run again in the dashboard.

    The run may be finished, killed or still being written. The tree, the map, charts and events are
    those of the run, at any time of it. Keys: space plays or pauses, , and . step, [ ] and { } skip
    5 s and a minute, n and N go to the next and the previous event, x and X to the next and the
    previous failure or silent sensor, s and S to the next and the previous change of the selected
    node, : to a time, enter shows whole texts, ? all keys. Nothing can be commanded.
    """
    from missions.execution.supervision.replaying import player_of, replay_run
    from missions.inspection.run_folders import find_run

    player = player_of(find_run(run, Path("runs")), at, speed)
    if not on_a_terminal():
        player.close()
        raise InputError("replay needs a terminal; without one, use `treepilot trace`")
    raise typer.Exit(replay_run(player))
