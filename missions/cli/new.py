"""`treepilot new`: writes a mission, a world, a robot, or a plugin with its test."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

new_app = typer.Typer(
    no_args_is_help=True, help="Create a mission, world, robot or plugin from a template."
)


NewName = Annotated[str, typer.Argument(help="name as used in missions, e.g. ring_bell")]
PluginFolder = Annotated[Path, typer.Option("--in", help="plugin folder; created if missing")]


FileName = Annotated[str, typer.Argument(help="name of the file, without .yaml")]
FileFolder = Annotated[Path, typer.Option("--in", help="folder; created if missing")]


@new_app.command("mission")
def new_mission(
    name: FileName,
    world: Annotated[str, typer.Option(help="world: a name or a file")] = "office",
    robot: Annotated[str, typer.Option(help="robot: a name or a robot.yaml")] = "scout",
    folder: FileFolder = Path(),
) -> None:
    """Create a mission file with comments that runs."""
    from missions.inspection.file_scaffold import new_mission as write

    file = write(name, folder, world, robot)
    typer.echo(f"wrote {file}\n\nRun it:  treepilot run {file}")


@new_app.command("world")
def new_world(name: FileName, folder: FileFolder = Path()) -> None:
    """Create a world file with comments: two rooms with furniture."""
    from missions.inspection.file_scaffold import new_world as write

    file = write(name, folder)
    path = file if file.is_absolute() else f"./{file}"
    typer.echo(f"wrote {file}\n\nUse it in a mission beside it:  world: ./{file.name}")
    typer.echo(f"See it:  treepilot show world {path} --png {file.stem}.png")


@new_app.command("robot")
def new_robot(
    urdf: Annotated[Path, typer.Option(help="URDF or xacro file")],
    name: Annotated[str, typer.Argument(help="name of the robot; default: that of the URDF")] = "",
    folder: FileFolder = Path(),
    packages: Annotated[
        list[str] | None,
        typer.Option(help="folder with packages that the file names; may be repeated"),
    ] = None,
    arguments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="argument of a xacro file; repeatable"),
    ] = None,
) -> None:
    """Create a robot.yaml for a URDF: its drive, arm, outline and sensors."""
    from missions.cli.arguments import assignments
    from missions.inspection.file_scaffold import new_robot as write

    given = assignments(arguments or [], example="use_sim=true")
    file, proposal = write(name, folder, urdf, packages or [], given)
    arm = f"arm of {proposal.joints} joints, " if proposal.joints else ""
    typer.echo(f"wrote {file}: drive {proposal.drive}, {arm}mass {proposal.mass:.3g} kg\n")
    path = file if file.is_absolute() else f"./{file}"
    if proposal.drive == "none":
        typer.echo("Correct `mount`, `home` and what the URDF does not know of the sensors.")
        typer.echo(f"Check it:  treepilot check {path}\nSee it:    treepilot frames {path}")
        return
    typer.echo("Correct `limits`, and what the URDF does not know of the sensors.")
    typer.echo(f"Check it:  treepilot check {path}\nDrive it:  treepilot drive --robot {path}")


@new_app.command("behaviour")
def new_behaviour(name: NewName, folder: PluginFolder = Path("my_behaviours")) -> None:
    """Create a behaviour and its test."""
    from behaviours.scaffold import new_behaviour as write
    from missions.language.sections import mission_words

    _report(write(name, folder, mission_words()), folder, f"run:\n  {name}: {{}}")


def _add(kind: str, what: str, setting: str) -> None:
    """Add the command for a kind of component; `setting` uses NAME in a mission."""

    @new_app.command(kind, help=f"Create {what} and its test.")
    def command(name: NewName, folder: PluginFolder = Path("my_plugins")) -> None:
        from missions.inspection.component_scaffold import new_component

        _report(new_component(kind, name, folder), folder, setting.replace("NAME", name))


_add("planner", "a global planner", "navigation: {planner: NAME}")
_add("controller", "a path-following controller", "navigation: {controller: NAME}")
_add("estimator", "an estimator of the pose", "localisation: NAME")
_add(
    "layer", "a costmap layer", "navigation: {costmap: {layers: [static, obstacle, NAME]}}"
)  # fmt: skip


def _report(files: list[Path], folder: Path, setting: str) -> None:
    plugin = folder if folder.is_absolute() else f"./{folder}"
    for file in files:
        typer.echo(f"wrote {file}")
    # pytest is not among the dependencies.
    test = f"python -m pytest {files[-1]}"
    with_pytest = f"Run the test:  {test}"
    without = f"To run the test, install pytest (pip install pytest), then:  {test}"
    typer.echo(f"\n{with_pytest if find_spec('pytest') else without}")
    typer.echo("Use it in a mission next to the folder:\n")
    typer.echo("\n".join(f"    {line}" for line in [f"plugins: [{plugin}]", *setting.splitlines()]))


@new_app.callback()
def _new() -> None:
    """Create a mission, world, robot or plugin from a template."""
