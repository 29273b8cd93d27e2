"""`treepilot schema`: writes JSON Schemas for editors."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class SchemaKind(StrEnum):
    """What `treepilot schema` knows."""

    MISSION = "mission"
    WORLD = "world"
    ROBOT = "robot"


def schema(
    kind: Annotated[SchemaKind, typer.Argument(help="of which files")] = SchemaKind.MISSION,
    out: Annotated[Path | None, typer.Option(help="write it there [default: print it]")] = None,
    plugins: Annotated[
        list[str] | None, typer.Option(metavar="PLUGIN", help="as under `plugins` of a mission")
    ] = None,
) -> None:
    """JSON Schema of mission, world or robot files, for editors (docs/editors.md)."""
    from missions.editor.schemas import schema_text

    text = schema_text(kind.value, plugins or [])
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, "utf-8")
        typer.echo(f"wrote {out}", err=True)
