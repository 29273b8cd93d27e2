"""`treepilot tell`: sends commands to a running mission."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from missions.execution.client.connection import Connection

HELP = """Send a command to a running mission.

RUN is the folder of a run, its name, the first digits of its identity, or `only` for the only live
run. If several runs match, they are listed and the command is not sent; `treepilot watch --list`
lists all. NODE is a number (listed by `treepilot tell RUN nodes`), a name, a path such as
`patrol/inspect/drive`, or a position such as `patrol.yaml:31`. If the robot refuses a command, the
reason is printed and the exit code is 1.

\b
    treepilot tell only goal kitchen
    treepilot tell only goal 3.2,1.1,90deg --wait
    treepilot tell only behaviour spin angle=90deg
    treepilot tell only set controller.cruise_speed=30cm/s
    treepilot tell only break "back to the dock"
    treepilot tell only step 5
    treepilot tell only force drive failure --code NO_VALID_PATH

A simulation can be disturbed too; a real robot refuses these:

\b
    treepilot tell only drop_box
    treepilot tell only move_door lab --close
    treepilot tell only push --left 10cm --turn 30deg
    treepilot tell only lift kitchen
    treepilot tell only silence_sensor lidar
    treepilot tell only set_charge 0.15
"""

tell_app = typer.Typer(no_args_is_help=True, help=HELP)

MINUS = {"ignore_unknown_options": True}
"""A coordinate may begin with a minus."""

PoseArgument = Annotated[
    str, typer.Argument(metavar="POSE", help="a place, or x,y,heading such as 3.2,1.1,90deg")
]
Wait = Annotated[bool, typer.Option("--wait", help="return when it has ended; exit 1 if it fails")]

NodeArgument = Annotated[
    str, typer.Argument(metavar="NODE", help="number, name, path or file:line")
]


@tell_app.callback()
def _tell(
    context: typer.Context,
    run: Annotated[
        str, typer.Argument(metavar="RUN", help="folder, name or first digits of a run, or `only`")
    ],
) -> None:
    context.obj = run


@tell_app.command(context_settings=MINUS)
def goal(context: typer.Context, pose: PoseArgument, wait: Wait = False) -> None:
    """Pause the mission and drive to a place or pose; `resume` continues the mission."""
    from missions.execution.client.telling import go

    _ask(context, lambda robot: go(robot, pose, wait=wait))


@tell_app.command(context_settings=MINUS)
def pose(context: typer.Context, pose: PoseArgument) -> None:
    """Tell the robot where it is."""
    _ask(context, lambda robot: robot.set_pose(pose))


@tell_app.command("set")
def set_(
    context: typer.Context,
    assignment: Annotated[
        str, typer.Argument(metavar="NAME=VALUE", help="e.g. controller.cruise_speed=30cm/s")
    ],
) -> None:
    """Change a parameter; `treepilot parameters` lists them."""
    from missions.execution.client.telling import change

    _ask(context, lambda robot: change(robot, assignment))


@tell_app.command()
def speed(
    context: typer.Context,
    factor: Annotated[float, typer.Argument(help="simulated seconds per second; 0: no limit")],
) -> None:
    """Change the speed of a simulation."""
    _send(context, "speed", factor=factor)


@tell_app.command()
def behaviour(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="e.g. spin; `treepilot list behaviours` lists them")],
    ports: Annotated[
        list[str] | None, typer.Argument(metavar="[PORT=VALUE]...", help="e.g. angle=90deg")
    ] = None,
    wait: Wait = False,
) -> None:
    """Pause the mission and carry out one behaviour; `resume` continues the mission."""
    from missions.execution.client.telling import carry_out

    _ask(context, lambda robot: carry_out(robot, name, ports or [], wait=wait))


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
        Literal["success", "failure", "off", "due"],
        typer.Argument(metavar="OUTCOME", help="success | failure | off | due (fires an event)"),
    ],
    code: Annotated[str, typer.Option(help="failure code, e.g. NO_VALID_PATH")] = "",
) -> None:
    """Skip a node and return success or failure instead."""
    given = {"code": code} if code else {}
    _send(context, "force", node=node, status=outcome, **given)


@tell_app.command("drop_box", context_settings=MINUS)
def drop_box(
    context: typer.Context,
    pose: Annotated[
        str, typer.Argument(metavar="[POSE]", help="as for `goal` [default: before the robot]")
    ] = "",
    length: Annotated[str | None, typer.Option(help="e.g. 60cm")] = None,
    width: Annotated[str | None, typer.Option(help="e.g. 60cm")] = None,
    height: Annotated[str | None, typer.Option(help="e.g. 1m")] = None,
) -> None:
    """Simulation: drop a box before the robot, or at a pose.

    Example: treepilot tell only drop_box 3.2,1.1 --length 80cm
    """
    _ask(
        context,
        lambda robot: robot.drop_box(pose or None, length=length, width=width, height=height),
    )


@tell_app.command("move_door")
def move_door(
    context: typer.Context,
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help="of the door [default: the nearest one]")
    ] = "",
    closed: Annotated[
        bool | None, typer.Option("--close/--open", help="default: the other way than it is")
    ] = None,
) -> None:
    """Simulation: close or open a door.

    Example: treepilot tell only move_door lab --close
    """
    _ask(context, lambda robot: robot.move_door(name, closed=closed))


@tell_app.command()
def push(
    context: typer.Context,
    forward: Annotated[str, typer.Option(help="e.g. 20cm")] = "0 m",
    left: Annotated[str, typer.Option(help="e.g. -5cm")] = "0 m",
    turn: Annotated[str, typer.Option(help="anticlockwise, e.g. 30deg")] = "0 deg",
) -> None:
    """Simulation: push the robot.

    Example: treepilot tell only push --left 10cm --turn 30deg
    """
    _ask(context, lambda robot: robot.push(forward, left, turn))


@tell_app.command(context_settings=MINUS)
def lift(context: typer.Context, pose: PoseArgument) -> None:
    """Simulation: lift the robot to a pose.

    Its odometry does not notice.

    Example: treepilot tell only lift kitchen
    """
    _ask(context, lambda robot: robot.lift(pose))


@tell_app.command("silence_sensor")
def silence_sensor(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="of the sensor, e.g. lidar")],
    works: Annotated[bool, typer.Option("--works", help="let it deliver again")] = False,
) -> None:
    """Simulation: stop the measurements of a sensor.

    Example: treepilot tell only silence_sensor lidar
    """
    _ask(context, lambda robot: robot.silence_sensor(name, works=works))


@tell_app.command("set_charge")
def set_charge(
    context: typer.Context,
    charge: Annotated[str, typer.Argument(metavar="CHARGE", help="e.g. 0.3 or 30%")],
) -> None:
    """Simulation: set the charge of the battery.

    Example: treepilot tell only set_charge 0.15
    """
    _ask(context, lambda robot: robot.set_charge(charge))


@tell_app.command()
def nodes(context: typer.Context) -> None:
    """List the nodes with number, status and breakpoint."""
    from missions.execution.client.telling import status_lines

    for line in status_lines(context.obj):
        typer.echo(line)


def _add(kind: str, sentence: str, name: str = "", **arguments: Any) -> None:
    """Add a command without arguments of its own."""

    @tell_app.command(name or kind, help=sentence)
    def command(context: typer.Context) -> None:
        _send(context, kind, **arguments)


def _ask(context: typer.Context, act: "Callable[[Connection], str | None]") -> None:
    from missions.execution.client.telling import ask

    _answer(lambda: ask(context.obj, act))


def _send(context: typer.Context, kind: str, **arguments: Any) -> None:
    from missions.execution.client.telling import tell

    _answer(lambda: tell(context.obj, kind, arguments))


def _answer(command: Callable[[], str]) -> None:
    """Print the answer to a command; a refusal or failure exits with 1."""
    from missions.execution.client.conversation import CommandRefused
    from stack.errors import NavigationError

    try:
        typer.echo(command())
    except (CommandRefused, NavigationError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None


_add("pause", "Pause the mission; the robot stops.")
_add("resume", "Resume after a pause, a step or a breakpoint.")
_add("continue", "Same as resume.")
_add(
    "cancel_goal", "End a goal or behaviour; the mission stays paused.",
    name="cancel",
)  # fmt: skip
_add("abort", "Stop the robot and abort the mission.", reason="by the operator")
_add(
    "estop", "Trigger the emergency stop; `release` resets it, then `resume` continues.",
    reason="operator",
)  # fmt: skip
_add("release", "Reset the emergency stop.")
