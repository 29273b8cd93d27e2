"""`treepilot export`: a run as one file for other programs."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from stack.errors import InputError


def export(
    run: Annotated[str, typer.Argument(help="run folder, name of a run in ./runs, or `newest`")],
    mcap: Annotated[
        bool, typer.Option("--mcap", help="an MCAP file with Foxglove's schemas")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="default: foxglove.mcap in the run folder"
        ),
    ] = None,
    layout: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="also write panels for Foxglove, the same for all"),
    ] = None,
) -> None:
    """Write a run as one file for other programs; list its topics.

    --mcap writes an MCAP file with Foxglove's well-known schemas, for the Foxglove app
    (https://app.foxglove.dev, "Open local file"), its forks, and every reader of MCAP and protobuf.
    It holds the frames, poses, scans, maps and costmaps, plans, people, tracks, the shapes of the
    world, the events, and as JSON the tree, the state and all figures. Of a run with `--record
    sensors` it also holds every measurement and the pictures.

    \b
        treepilot export newest --mcap
        treepilot export 02_office_patrol-20261122-164218 --mcap -o office.mcap
        treepilot export newest --mcap --layout treepilot.json

    --layout writes the panels with which a run is seen best. Import them once, in Foxglove's menu
    of layouts: "Import from file".

    It needs `pip install 'treepilot[foxglove]'`. Times count from the start of the robot's clock.
    """
    from missions.inspection.exchange.exporting import (
        FILE,
        export_mcap,
        summary_lines,
        write_layout,
    )
    from missions.inspection.run_folders import find_run, size_text

    if not mcap:
        raise InputError("export writes one format now: give --mcap")
    folder = find_run(run, Path("runs"))
    file = out or folder / FILE
    topics = export_mcap(folder, file)
    typer.echo("\n".join(summary_lines(topics)))
    if layout is not None:
        write_layout(layout)
    messages = sum(topic.messages for topic in topics)
    size = size_text(file.stat().st_size)
    typer.echo(f"{shlex.quote(str(file))}: {messages} messages, {size}")
