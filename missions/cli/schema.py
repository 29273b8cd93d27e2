"""`treepilot schema` and `treepilot lsp`: JSON Schemas and the language server, for editors."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class SchemaKind(StrEnum):
    """Kinds of files that have a schema."""

    MISSION = "mission"
    WORLD = "world"
    ROBOT = "robot"
    MARKERS = "markers"


def schema(
    kind: Annotated[SchemaKind, typer.Argument(help="kind of file")] = SchemaKind.MISSION,
    out: Annotated[Path | None, typer.Option(help="output file [default: print]")] = None,
    plugins: Annotated[
        list[str] | None,
        typer.Option(metavar="PLUGIN", help="plugin to include, as under `plugins` of a mission"),
    ] = None,
) -> None:
    """Print the JSON Schema of a kind of file, for editors.

    docs/editors.md says how to use it in an editor.
    """
    from missions.editor.schemas import schema_text

    text = schema_text(kind.value, plugins or [])
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, "utf-8")
        typer.echo(f"wrote {out}", err=True)


def lsp() -> None:
    """Run the language server for mission files on stdin/stdout.

    docs/editors.md says how to configure an editor.
    """
    from missions.editor.serving import serve

    serve()
