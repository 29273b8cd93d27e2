"""`treepilot tell`: sends commands to a running mission."""

from enum import StrEnum
from typing import Annotated, Any

import typer

HELP = """Send a command to a running mission.

RUN is the folder of a run, its name, the first digits of its identity, or `only` for the only live
run. If several runs match, they are listed and the command is not sent; `treepilot watch --list`
lists all. NODE is a number (listed by `treepilot tell RUN nodes`), a name, a path such as
`patrol/inspect/drive`, or a position such as `patrol.yaml:31`.

\b
    treepilot tell only break "back to the dock"
    treepilot tell only step 5
    treepilot tell only force drive failure --code NO_VALID_PATH
"""

tell_app = typer.Typer(no_args_is_help=True, help=HELP)

NodeArgument = Annotated[
    str, typer.Argument(metavar="NODE", help="number, name, path or file:line")
]


class Outcome(StrEnum):
    """Outcomes that can be forced on a node."""

    SUCCESS = "success"
    FAILURE = "failure"
    OFF = "off"
    DUE = "due"


@tell_app.callback()
def _tell(
    context: typer.Context,
    run: Annotated[
        str, typer.Argument(metavar="RUN", help="folder, name or first digits of a run, or `only`")
    ],
) -> None:
    context.obj = run


@tell_app.command()
def step(
    context: typer.Context,
    ticks: Annotated[int, typer.Argument(min=1, help="number of ticks")] = 1,
) -> None:
    """Run a number of ticks (0.1 s each), then pause again."""
    _send(context, "step", ticks=ticks)


@tell_app.command("break")
def break_(context: typer.Context, node: NodeArgument) -> None:
    """Set a breakpoint: pause before a node starts."""
    _send(context, "break", node=node)


@tell_app.command()
def unbreak(
    context: typer.Context,
    node: Annotated[
        str, typer.Argument(help="node with the breakpoint [default: all breakpoints]")
    ] = "",
) -> None:
    """Remove one breakpoint or all."""
    _send(context, "unbreak", **({"node": node} if node else {}))


@tell_app.command()
def force(
    context: typer.Context,
    node: NodeArgument,
    outcome: Annotated[
        Outcome,
        typer.Argument(metavar="OUTCOME", help="success | failure | off | due (fires an event)"),
    ],
    code: Annotated[str, typer.Option(help="failure code, e.g. NO_VALID_PATH")] = "",
) -> None:
    """Skip a node and return success or failure instead."""
    given = {"code": code} if code else {}
    _send(context, "force", node=node, status=outcome.value, **given)


@tell_app.command()
def nodes(context: typer.Context) -> None:
    """List the nodes with number, status and breakpoint."""
    from missions.execution.client.telling import status_lines

    for line in status_lines(context.obj):
        typer.echo(line)


def _add(kind: str, sentence: str, **arguments: Any) -> None:
    """Add a command without arguments of its own."""

    @tell_app.command(kind, help=sentence)
    def command(context: typer.Context) -> None:
        _send(context, kind, **arguments)


def _send(context: typer.Context, kind: str, **arguments: Any) -> None:
    from missions.execution.client.telling import tell

    typer.echo(tell(context.obj, kind, arguments))


_add("pause", "Pause the mission; the robot stops.")
_add("resume", "Resume after a pause, a step or a breakpoint.")
_add("continue", "Same as resume.")
_add("abort", "Stop the robot and abort the mission.", reason="by the operator")
_add(
    "estop", "Trigger the emergency stop; `release` resets it, then `resume` continues.",
    reason="operator",
)  # fmt: skip
_add("release", "Reset the emergency stop.")
