"""`treepilot explain`: the cause, an example and the fix of a finding."""

from __future__ import annotations

from typing import Annotated

import typer


def explain(
    code: Annotated[str, typer.Argument(help="the code of a finding, e.g. E132")],
) -> None:
    """What a finding means: its cause, an example and the fix."""
    from missions.inspection.explain import explanation

    typer.echo(explanation(code))
