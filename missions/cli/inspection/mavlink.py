"""`treepilot mavlink`: who is on a MAVLink address."""

import json
from typing import Annotated

import typer

EPILOG = """
\b
treepilot mavlink udpin:127.0.0.1:14550          # who sends to this port
treepilot mavlink serial:/dev/ttyACM0:57600 --seconds 5
treepilot mavlink tcp:192.168.1.5:5760 --json
"""


def mavlink(
    address: Annotated[
        str, typer.Argument(metavar="ADDRESS", help="udpin:…, udpout:…, tcp:…, tcpin:…, serial:…")
    ],
    seconds: Annotated[
        float, typer.Option(min=0.5, max=600.0, help="how long it is listened")
    ] = 3.0,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """List who is on a MAVLink address, and what they send.

    Of each component: type, autopilot, version, mode, and its messages with their rates.
    """
    from missions.inspection.mavlink_systems import listen

    heard = listen(address, seconds)
    if as_json:
        typer.echo(json.dumps(heard.plain(), indent=2))
    else:
        for line in heard.lines():
            typer.echo(line)
        if not heard.components:
            typer.echo(f"nothing heard on {address} in {seconds:g} s", err=True)
    raise typer.Exit(0 if heard.components else 1)
