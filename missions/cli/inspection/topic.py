"""`treepilot topic`: what a live or recorded run says, field by field."""

from contextlib import closing
from typing import Annotated

import typer

from stack.errors import InputError

HELP = """Print poses, scans, events and more of a live or recorded run.

RUN is the folder, name or first digits of a live run, or the folder of a recorded one, its name in
./runs, or `newest`. Without it: the only live run, or else the newest recorded one. A topic is a
field of the snapshots that dashboards get (at most 20 a second), or a part of one; `events`; or
`sensors.NAME`, if the run was recorded with `--record sensors`.

\b
    treepilot topic list
    treepilot topic echo pose
    treepilot topic echo newest counters.replans --every 10
    treepilot topic echo events --json -n 5
    treepilot topic hz scan
"""

topic_app = typer.Typer(no_args_is_help=True, help=HELP)

RunAndTopic = Annotated[list[str], typer.Argument(metavar="[RUN] TOPIC", help="see above")]
Count = Annotated[int | None, typer.Option("-n", min=1, metavar="N", help="stop after N")]


@topic_app.command("list")
def list_(
    run: Annotated[str, typer.Argument(help="a run [default: live or newest]")] = "",
) -> None:
    """List the topics of a run with their types.

    `no message` marks those without a value so far, or in the recording.
    """
    from missions.inspection.topics import list_lines, topics_of
    from stack.columns import columns

    for line in columns(list(list_lines(topics_of(run)))):
        typer.echo(line)


@topic_app.command()
def echo(
    words: RunAndTopic,
    count: Count = None,
    every: Annotated[float, typer.Option(min=0.0, help="robot seconds between messages")] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="a line of JSON for each")] = False,
    full: Annotated[bool, typer.Option("--full", help="print long lists whole")] = False,
) -> None:
    """Print the messages of a topic as YAML; ctrl+c ends it."""
    from missions.inspection import topics as read

    run, topic = _words(words)
    with closing(read.topics_of(run)) as topics:
        found = read.spaced(read.messages(topics, topic), every)
        read.take(count, read.echo(found, topic, as_json=as_json, full=full), typer.echo)


@topic_app.command()
def hz(words: RunAndTopic, count: Count = None) -> None:
    """Print rate, periods and age of a topic: each second of a live run, or of a whole recording.

    Rates and periods are in seconds of the robot's clock, by the stamps of measurements. While that
    clock stands still, as in a paused simulation, nothing is new and nothing is printed. Fields of
    a recorded run have the rate of its recording; `sensors.NAME` has every measurement.
    """
    from missions.inspection import topics as read

    run, topic = _words(words)
    with closing(read.topics_of(run)) as topics:
        live = isinstance(topics, read.LiveTopics)
        read.take(count, read.rates(read.messages(topics, topic), topic, live=live), typer.echo)


def _words(words: list[str]) -> tuple[str, str]:
    if len(words) > 2:
        raise InputError(f"expected [RUN] TOPIC, got {len(words)} words: {' '.join(words)}")
    return ("", words[0]) if len(words) == 1 else (words[0], words[1])
