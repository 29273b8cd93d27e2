"""`treepilot diagnose`: why a run failed."""

import json
from pathlib import Path
from typing import Annotated

import typer


def diagnose(
    run: Annotated[str, typer.Argument(help="run folder, name of a run in ./runs, or `newest`")],
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Say why a run failed: the likely causes, the strongest first.

    Each cause has its strength, the share of the failure that the evidence explains; the
    evidence, with times and places; and what to do. The records of the run are enough: nothing
    is run again. A run that succeeded has no causes.

    Example: treepilot diagnose newest
    """
    from missions.inspection.causes.ranking import causes_of
    from missions.inspection.causes.telling import lines_of, plain_of
    from missions.inspection.page.story import read_story
    from missions.inspection.run_folders import find_run

    story = read_story(find_run(run, Path("runs")))
    causes = causes_of(story)
    if as_json:
        typer.echo(json.dumps(plain_of(story, causes), indent=2, ensure_ascii=False))
        return
    for line in lines_of(story, causes):
        typer.echo(line)
