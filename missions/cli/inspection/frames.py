"""`treepilot frames`: the frames of a robot or of a run."""

from pathlib import Path
from typing import Annotated

import typer


def frames(
    named: Annotated[
        str, typer.Argument(metavar="[RUN|ROBOT]", help="a run or a robot [default: newest run]")
    ] = "",
) -> None:
    """Draw the tree of frames of a robot or a run.

    Each frame has a line with its parent, how it moves, and who publishes it. Of a robot (its name
    or robot.yaml) these are the links of the URDF and the sensors. Of a recorded run (its folder,
    its name in ./runs, or `newest`) also map and odom, and for each moving frame the rate of its
    values and the age of the newest one at the end, by the snapshots, which are recorded at most
    10 times per second.

    \b
        treepilot frames panda_table
        treepilot frames newest
    """
    from missions.inspection.frames import frame_lines

    for line in frame_lines(named, Path(), Path("runs")):
        typer.echo(line)
