"""`treepilot new`: writes working examples to start from. A part of missions.cli.app."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

new_app = typer.Typer(no_args_is_help=True, help="Write a working example to start from.")


NewName = Annotated[str, typer.Argument(help="as missions will write it, e.g. ring_bell")]
PluginFolder = Annotated[Path, typer.Option("--in", help="the folder of plugins, made if need be")]


@new_app.command("behaviour")
def new_behaviour(name: NewName, folder: PluginFolder = Path("my_behaviours")) -> None:
    """A plugin behaviour and its test."""
    from behaviours.scaffold import new_behaviour as write

    _tell_of(write(name, folder), folder, f"run:\n  {name}: {{}}")


@new_app.command("planner")
def new_planner(name: NewName, folder: PluginFolder = Path("my_plugins")) -> None:
    """A global planner and its test."""
    from missions.inspection.scaffold import new_component

    setting = f"navigation: {{planner: {name}}}"
    _tell_of(new_component("planner", name, folder), folder, setting)


@new_app.command("controller")
def new_controller(name: NewName, folder: PluginFolder = Path("my_plugins")) -> None:
    """A controller, which follows paths, and its test."""
    from missions.inspection.scaffold import new_component

    setting = f"navigation: {{controller: {name}}}"
    _tell_of(new_component("controller", name, folder), folder, setting)


@new_app.command("layer")
def new_layer(name: NewName, folder: PluginFolder = Path("my_plugins")) -> None:
    """A layer of the costmaps and its test."""
    from missions.inspection.scaffold import new_component

    setting = f"navigation: {{costmap: {{layers: [static, obstacle, inflation, {name}]}}}}"
    _tell_of(new_component("layer", name, folder), folder, setting)


def _tell_of(files: list[Path], folder: Path, setting: str) -> None:
    plugin = folder if folder.is_absolute() else f"./{folder}"
    for file in files:
        typer.echo(f"wrote {file}")
    typer.echo(f"\nIts test:  python -m pytest {files[-1]}\nIn a mission beside the folder:\n")
    typer.echo("\n".join(f"    {line}" for line in [f"plugins: [{plugin}]", *setting.splitlines()]))


@new_app.callback()
def _new() -> None:
    """Write a working example to start from."""
