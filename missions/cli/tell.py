"""`treepilot tell`: orders for a running mission. A part of missions.cli.app."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

import typer

HELP = """Give an order to a running mission: pause, step, stop before a node, force an outcome.

RUN is the run's name or folder, or `newest`. For NODE write its number (`treepilot tell RUN nodes`
lists them), its name, a path such as `patrol/inspect/drive`, or where it stands: `patrol.yaml:31`.

\b
    treepilot tell newest break "back to the dock"
    treepilot tell newest step 5
    treepilot tell newest force drive failure --code NO_VALID_PATH
"""

tell_app = typer.Typer(no_args_is_help=True, help=HELP)

NodeArgument = Annotated[
    str, typer.Argument(metavar="NODE", help="number, name, path or file:line")
]


class Outcome(StrEnum):
    """What can be forced on a node."""

    SUCCESS = "success"
    FAILURE = "failure"
    OFF = "off"
    DUE = "due"


@tell_app.callback()
def _tell(
    context: typer.Context,
    run: Annotated[
        str, typer.Argument(metavar="RUN", help="name or folder of the run, or `newest`")
    ],
) -> None:
    context.obj = "" if run == "newest" else run


@tell_app.command()
def pause(context: typer.Context) -> None:
    """Stop the robot and its clock."""
    _order(context, "pause")


@tell_app.command()
def resume(context: typer.Context) -> None:
    """Go on after a pause, a step or a breakpoint."""
    _order(context, "resume")


@tell_app.command("continue")
def continue_(context: typer.Context) -> None:
    """Go on after a pause, a step or a breakpoint; the same as resume."""
    _order(context, "continue")


@tell_app.command()
def step(
    context: typer.Context,
    ticks: Annotated[int, typer.Argument(min=1, help="ticks of the tree")] = 1,
) -> None:
    """Go on for some ticks of the tree, a tenth of a second each, and pause again."""
    _order(context, "step", ticks=ticks)


@tell_app.command("break")
def break_(context: typer.Context, node: NodeArgument) -> None:
    """Pause whenever a node is about to start."""
    _order(context, "break", node=node)


@tell_app.command()
def unbreak(
    context: typer.Context,
    node: Annotated[str, typer.Argument(help="as for break [default: all of them]")] = "",
) -> None:
    """Take a breakpoint away, or all."""
    _order(context, "unbreak", **({"node": node} if node else {}))


@tell_app.command()
def force(
    context: typer.Context,
    node: NodeArgument,
    outcome: Annotated[
        Outcome,
        typer.Argument(metavar="OUTCOME", help="success | failure | off | due (an event comes)"),
    ],
    code: Annotated[str, typer.Option(help="of a failure, e.g. NO_VALID_PATH")] = "",
) -> None:
    """Do not run a node: whenever it has a turn, it answers success or failure at once."""
    given = {"code": code} if code else {}
    _order(context, "force", node=node, status=outcome.value, **given)


@tell_app.command()
def abort(context: typer.Context) -> None:
    """Stop the robot and end the mission as aborted."""
    _order(context, "abort", reason="by the operator")


@tell_app.command()
def estop(context: typer.Context) -> None:
    """Emergency stop; `release` releases it."""
    _order(context, "estop", reason="operator")


@tell_app.command()
def release(context: typer.Context) -> None:
    """Release the emergency stop."""
    _order(context, "release")


@tell_app.command()
def nodes(context: typer.Context) -> None:
    """How it goes, and every node with its number, status and breakpoint."""
    from missions.execution.client import status_lines

    for line in status_lines(context.obj):
        typer.echo(line)


def _order(context: typer.Context, kind: str, **arguments: Any) -> None:
    from missions.execution.client import tell

    typer.echo(tell(context.obj, kind, arguments))
