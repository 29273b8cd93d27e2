"""`treepilot jitter`: which rate of the fast loop this machine can hold."""

import json
from typing import Annotated

import typer


def jitter(
    rate: Annotated[
        float, typer.Option(help="cycles per second", min=50.0, max=1000.0, metavar="HZ")
    ] = 1000.0,
    seconds: Annotated[
        float, typer.Option(help="of each of the two measurements", min=1.0, max=3600.0)
    ] = 10.0,
    load: Annotated[bool, typer.Option("--load", help="keep all processors busy")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Measure how late the fast loop runs on this machine.

    The loop runs with emulated wheels, first with the real-time privileges that this user gets,
    then without. What was not granted is printed with the command that grants it. Nothing moves.
    Exit code 1: the machine does not hold the rate with the privileges that it has.

    Example: treepilot jitter --seconds 60 --load
    """
    from stack.fast_loop.jitter import described, measure, plain

    found = []
    for privileged in (True, False):
        found.append(measure(rate, seconds, privileged=privileged, load=load))
        if not as_json:
            typer.echo(described(found[-1], load))
    if as_json:
        typer.echo(json.dumps({"measurements": [plain(item, load) for item in found]}, indent=2))
    raise typer.Exit(0 if found[0].holds_its_rate else 1)
