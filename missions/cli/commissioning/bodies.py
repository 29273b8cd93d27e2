"""Which robot is commissioned: options of the commands, and its body."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from stack.body import Body

BodyOption = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="what drives the robot: simulated, scripted, or a plugin's [default: the robot "
        "file's choice]",
        show_default=False,
    ),
]

WorldOption = Annotated[
    str | None,
    typer.Option(help="world of a simulated robot: a name or a file [default: test_floor]"),
]

StartOption = Annotated[
    str | None, typer.Option(metavar="X,Y,HEADING", help="start of a simulated robot")
]

SeedOption = Annotated[int, typer.Option(min=0, help="random seed of a simulated robot")]

DEFAULT_WORLD = "test_floor"


@contextmanager
def opened(  # noqa: PLR0913 - the options of a command
    robot: str,
    mission: str | None,
    body: str,
    world: str | None,
    start: str | None,
    seed: int,
) -> "Iterator[Body]":
    """Connect to a robot, or simulate it; stop and close it at the end.

    Raises:
        InputError: a file or an option is wrong.
        BodyError: the robot cannot be reached.
    """
    from missions.commissioning.bodies import open_body
    from missions.execution.prepare import RunOptions, prepare
    from missions.execution.resources import load_robot, load_world
    from missions.execution.scene import pose_of_option

    if mission is not None:
        plan = prepare(mission, RunOptions(robot=robot, world=world, start=start, body=body))
        described, place, pose = plan.robot, plan.world, plan.start
    else:
        described = load_robot(robot, Path.cwd())
        place = load_world(world or DEFAULT_WORLD, Path.cwd())
        pose = place.start if start is None else pose_of_option(start, place.places)
    made = open_body(described, place, pose, choice=body, seed=seed)
    try:
        yield made
    finally:
        made.close()
