"""The `treepilot` command: registers the commands and turns errors into exit codes.

Exit codes: 0 success · 1 the mission failed or was aborted · 2 the input is wrong ·
3 internal error or records lost · 130 interrupted.

No module of this package postpones its annotations with `from __future__ import annotations`: typer
would compile each of them twice at every start, which takes 50 ms.
"""

import os
from typing import Annotated, NoReturn

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # halves numpy's import time; before numpy

import typer

from missions.cli.bench import bench_app
from missions.cli.calibrate.command import calibrate_app
from missions.cli.commissioning.preflight import EPILOG as PREFLIGHT_EPILOG
from missions.cli.commissioning.preflight import preflight
from missions.cli.falsify import EPILOG as FALSIFY_EPILOG
from missions.cli.falsify import falsify
from missions.cli.inspection.check import check, explain
from missions.cli.inspection.diagnose import diagnose
from missions.cli.inspection.doctor import doctor
from missions.cli.inspection.export import export
from missions.cli.inspection.frames import frames
from missions.cli.inspection.list import describe, list_
from missions.cli.inspection.mavlink import EPILOG as MAVLINK_EPILOG
from missions.cli.inspection.mavlink import mavlink
from missions.cli.inspection.nav2 import nav2
from missions.cli.inspection.parameters import parameters
from missions.cli.inspection.report import report
from missions.cli.inspection.schema import schema
from missions.cli.inspection.show import show
from missions.cli.inspection.topic import topic_app
from missions.cli.inspection.trace import trace
from missions.cli.jitter import jitter
from missions.cli.keys import keys_app
from missions.cli.lsp import lsp
from missions.cli.map import map_app
from missions.cli.new import new_app
from missions.cli.running.demo import demo
from missions.cli.running.drive import drive
from missions.cli.running.replay import replay
from missions.cli.running.run import run
from missions.cli.running.runs import runs_app
from missions.cli.running.tell import tell_app
from missions.cli.running.watch import watch
from missions.cli.sweep import sweep_app
from missions.cli.test import test
from missions.cli.tune import EPILOG as TUNE_EPILOG
from missions.cli.tune import tune
from stack.errors import BodyError, InputError, ParameterError, TelemetryError

HELP = """Run behaviour-tree missions on a simulated robot.

Start with: treepilot demo
"""

app = typer.Typer(
    help=HELP, no_args_is_help=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip

app.command()(run)
app.command()(demo)
app.command()(check)
app.command()(explain)
app.command()(test)
app.command()(show)
app.command("list")(list_)
app.command()(describe)
app.command()(schema)
app.command()(parameters)
app.command()(nav2)
app.command()(jitter)
app.command(epilog=MAVLINK_EPILOG)(mavlink)
app.command(epilog=PREFLIGHT_EPILOG)(preflight)
app.command()(lsp)
app.command()(trace)
app.command()(report)
app.command()(export)
app.command()(diagnose)
app.command()(doctor)
app.command()(frames)
app.command()(watch)
app.command()(replay)
app.command()(drive)
app.add_typer(runs_app, name="runs")
app.add_typer(new_app, name="new")
app.add_typer(calibrate_app, name="calibrate")
app.add_typer(map_app, name="map")
app.add_typer(tell_app, name="tell")
app.add_typer(keys_app, name="keys")
app.add_typer(topic_app, name="topic")
app.add_typer(bench_app, name="bench")
app.add_typer(sweep_app, name="sweep")
app.command(epilog=TUNE_EPILOG)(tune)
app.command(epilog=FALSIFY_EPILOG)(falsify)


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    if version:
        from importlib.metadata import version as installed

        typer.echo(f"treepilot {installed('treepilot')}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit


def main() -> None:
    """The entry point: errors become sentences and exit codes."""
    try:
        app()
    except (InputError, ParameterError, TelemetryError) as error:
        _say(str(error))
        raise SystemExit(2) from None
    except BodyError as error:
        _say(f"robot failure: {error}")
        raise SystemExit(3) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    except OSError as error:
        if error.filename is None:
            _fail_internally()
        _say(f"{error.filename!s:.200}: {error.strerror}")
        raise SystemExit(2) from None
    except Exception:
        _fail_internally()


def _say(text: str) -> None:
    from stack.types.printable import printable  # imports NumPy with its package

    typer.echo(printable(text), err=True)


def _fail_internally() -> NoReturn:
    import traceback

    traceback.print_exc()
    typer.echo("internal error: a bug in treepilot, not in your mission", err=True)
    raise SystemExit(3) from None


if __name__ == "__main__":
    main()
