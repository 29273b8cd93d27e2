"""`treepilot keys`: makes the keys of signed links."""

from pathlib import Path
from typing import Annotated

import typer

keys_app = typer.Typer(no_args_is_help=True, help="Make keys of signed links.")


@keys_app.callback()
def _keys() -> None:
    pass


@keys_app.command("mavlink")
def mavlink(
    file: Annotated[Path, typer.Argument(help="file to write")] = Path("mavlink.key"),
) -> None:
    """Make a key for `treepilot run --mavlink-key FILE`.

    The file holds 64 hexadecimal digits, and only its owner can read it. Give the same digits to
    the ground station: `signing key DIGITS` in MAVProxy, MAVLink signing in QGroundControl.
    """
    from stack.mavlink.signing import make_key

    make_key(file)
    typer.echo(f"wrote {file}")
