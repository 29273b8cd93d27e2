"""`treepilot explain`: the cause, an example and the fix of a finding."""

from typing import Annotated

import typer


def explain(
    code: Annotated[str, typer.Argument(help="code of a finding, e.g. E132")],
) -> None:
    """Explain a finding: its cause, an example and the fix."""
    from missions.inspection.explain import explanation

    typer.echo(explanation(code))
