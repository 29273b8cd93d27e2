"""`treepilot sweep`: many runs of a mission, and what they show."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer
from typer.core import TyperGroup

from missions.cli import fault_suite
from missions.cli.arguments import OtherRobot, Parameters, Settings, assignments
from missions.cli.bench import named
from missions.cli.sweep_runs import Cluster, check_cluster, interruptible, progress, tell
from missions.cli.tune import duration
from stack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.sweeps.claims import Condition
    from missions.sweeps.row import SweepRow
    from missions.sweeps.sweep import Sweep
    from missions.sweeps.sweep_file import SweepFile

T = TypeVar("T")

FAULTS = "--faults"

HELP = """Run a mission many times, over seeds and factors.

\b
  treepilot sweep MISSION …        run; the same as `treepilot sweep run MISSION`
  treepilot sweep report DIR       write the page about a sweep, or two
  treepilot sweep --faults suite   missions by faults; the same as `treepilot sweep faults`
"""

EPILOG = """
\b
  treepilot sweep 02_office_patrol --runs 500 --jobs 8
  treepilot sweep my.yaml --runs 400 --vary controller.cruise_speed="uniform(0.3, 0.9)" \\
      --vary controller.use=pure_pursuit,mppi --worlds 'worlds/*.yaml' --jobs 8
  treepilot sweep my.yaml --runs 3000 --until 'success > 0.97 at 95 %'
  treepilot sweep night.yaml --fail-if 'success.low < 0.95'

A factor is an argument of the mission, a parameter of a component (`treepilot parameters MISSION`
lists them), `world`, `robot` or `start`. Its values are a list, a,b,c, or a distribution:
uniform(LOW, HIGH), loguniform(LOW, HIGH), or normal(MEAN, DEVIATION), which is cut at three
deviations. Every factor is tried on the mission before anything runs. A file has the same words:

\b
  mission: 02_office_patrol
  runs: 400
  vary:
    controller.cruise_speed: uniform(0.3, 0.9)
    controller.use: [pure_pursuit, mppi]

Results: runs.parquet, one row a run; sweep.json; runs/, the kept run folders. Run the command
again to continue an interrupted sweep. docs/sweeps.md lists the figures of --fail-if.
"""


class _Sweep(TyperGroup):
    """Reads `sweep MISSION` as `sweep run MISSION`, and `sweep --faults` as `sweep faults`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and FAULTS in (one[:8] for one in args):
            args = ["faults", *args]
        if args and args[0] not in self.commands:
            args = ["run", *args]
        return super().parse_args(ctx, args)


sweep_app = typer.Typer(cls=_Sweep, no_args_is_help=True, help=HELP)
sweep_app.command("faults", epilog=fault_suite.EPILOG)(fault_suite.faults)

FailIf = Annotated[
    list[str] | None,
    typer.Option(metavar="CONDITION", help="exit with 1 if it holds, e.g. 'success < 0.95'"),
]


@sweep_app.command("run", epilog=EPILOG)
def run(  # noqa: PLR0913 - each is an option of the command
    mission: Annotated[
        str, typer.Argument(metavar="MISSION", help="mission, its name, or the file of a sweep")
    ],
    runs: Annotated[int | None, typer.Option(min=1, help="number of runs [default: 100]")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUES", help="factor; repeatable [default: only the seed]"),
    ] = None,
    design: Annotated[
        str | None,
        typer.Option(help="grid, random, latin or sobol [default: grid of lists, else random]"),
    ] = None,
    worlds: Annotated[
        str | None, typer.Option(metavar="GLOB", help="world files, or names of shipped worlds")
    ] = None,
    robots: Annotated[
        str | None, typer.Option(metavar="NAMES", help="robots: names or robot.yaml files")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="of the first run [default: 0]")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes [default: 1]")] = None,
    cluster: Cluster = None,
    out: Annotated[
        Path | None, typer.Option(help="folder of the results [default: sweeps/MISSION]")
    ] = None,
    keep: Annotated[
        str | None, typer.Option(help="run folders: all, failures or none [default: failures]")
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option(metavar="DURATION", help="simulated time [default: 1 h]")
    ] = None,
    until: Annotated[
        str | None,
        typer.Option(metavar="CLAIM", help="stop once 'success > 0.97 at 95 %' is decided"),
    ] = None,
    fail_if: FailIf = None,
    hang_after: Annotated[
        str | None,
        typer.Option(metavar="DURATION", help="computing without progress [default: 5 min]"),
    ] = None,
    robot: OtherRobot = None,
    set_: Settings = None,
    parameter: Parameters = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="check it, print the first runs, and end")
    ] = False,
) -> None:
    """Run a mission many times, over seeds and factors.

    `treepilot sweep report DIR` writes the page about a sweep, or two; `treepilot sweep --faults
    suite` runs missions by faults.
    """
    from missions.sweeps.checking import checked
    from missions.sweeps.claims import read_claim
    from missions.sweeps.runner import SILENCE, ExecutionSettings, run_sweep
    from missions.sweeps.sweep import check_claim
    from missions.sweeps.sweep_file import EMPTY, is_sweep_file, read_sweep_file
    from missions.sweeps.table import SweepFolder

    words = read_sweep_file(Path(mission)) if is_sweep_file(Path(mission)) else EMPTY
    given = {
        "runs": runs, "design": design, "worlds": worlds, "seed": seed, "jobs": jobs,
        "cluster": cluster, "out": out, "keep": keep,
        "time_limit": None if time_limit is None else duration(time_limit, "--time-limit"),
        "hang_after": None if hang_after is None else duration(hang_after, "--hang-after"),
    }  # fmt: skip
    values = {**words.values, **{name: value for name, value in given.items() if value is not None}}
    values.setdefault("mission", mission)
    words = replace(
        _without_gaps(replace(words, values=values)),
        robots=named(robots) if robots is not None else words.robots,
        arguments={**words.arguments, **assignments(set_ or [])},
        parameters={
            **words.parameters,
            **assignments(parameter or [], "--parameter", "controller.cruise_speed=0.4"),
        },
    )  # fmt: skip
    sweep = _sweep_of(words, vary or [], robot)
    claim = words.until if until is None else _read("--until", read_claim, until)
    conditions = _conditions(fail_if) if fail_if else words.fail_if
    execution = ExecutionSettings(
        words.values.get("jobs", 1),
        claim,
        words.values.get("hang_after", SILENCE),
        words.values.get("cluster", ""),
    )
    check_cluster(words.values.get("cluster"), words.values.get("jobs"))
    if claim is not None:
        check_claim(sweep)
    ready = checked(sweep, words.refusal)
    if dry_run:
        _print_runs(ready.sweep)
        return
    folder = SweepFolder(Path(words.values.get("out", Path("sweeps") / Path(sweep.mission).stem)))
    shown = progress(sweep.runs)
    with interruptible(folder.path) as check:
        rows = run_sweep(ready, folder, replace(execution, check=check), shown.update)
    tell(shown.line(rows))
    for line in _summary(rows, folder.path):
        typer.echo(line)
    if claim is not None:
        typer.echo(claim.describe(rows))
    _end(conditions, rows)


def check_sweep_file(file: Path) -> None:
    """Check the file of a sweep, with its mission and all values; nothing runs.

    Raises:
        InputError: it has errors.
    """
    from missions.sweeps.checking import checked
    from missions.sweeps.sweep import check_claim
    from missions.sweeps.sweep_file import read_sweep_file

    words = _without_gaps(read_sweep_file(file))
    sweep = _sweep_of(words, [], None)
    if words.until is not None:
        check_claim(sweep)
    checked(sweep, words.refusal)


@sweep_app.command("report")
def report(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="one sweep, or two")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="default: DIR/report.html")
    ] = None,
    fail_if: FailIf = None,
) -> None:
    """Write an HTML page about a sweep; of two, the second one compared with the first.

    Success by factor, distributions, clusters of failures, sensitivities, and where runs fail. One
    file without scripts that needs no network.
    """
    from missions.sweeps.report.page import page_of
    from missions.sweeps.report.results import read_results

    if len(folders) > 2:
        raise InputError(f"{len(folders)} sweeps; one or two can be reported")
    conditions = _conditions(fail_if or [])
    results = [read_results(folder) for folder in folders]
    file = out or folders[0] / "report.html"
    file.write_text(page_of(results), "utf-8")
    typer.echo(str(file))
    _end(conditions, results[-1].rows)


def _without_gaps(words: "SweepFile") -> "SweepFile":
    """Return what a file says without the keys that it does not have."""
    values = {name: value for name, value in words.values.items() if value is not None}
    return replace(words, values=values)


def _sweep_of(words: "SweepFile", vary: list[str], robot: str | None) -> "Sweep":
    """Return the sweep; the command line wins over the file."""
    from missions.sweeps.design import DESIGNS, default_design
    from missions.sweeps.factors import read_factor
    from missions.sweeps.sweep import FAILURES, KEEP, TIME_LIMIT, Sweep, with_choices

    factors = {factor.name: factor for factor in words.factors}
    for name, text in assignments(vary, "--vary", "controller.cruise_speed=0.4,0.8").items():
        factors[name] = _read(f"--vary {name}={text}", partial(read_factor, name), text)
    values = words.values
    for option, allowed in (("design", DESIGNS), ("keep", KEEP)):
        if values.get(option, allowed[0]) not in allowed:
            raise InputError(f"--{option} {values[option]}: expected one of {', '.join(allowed)}")
    sweep = Sweep(
        values["mission"], values.get("runs", 100), "", tuple(factors.values()),
        values.get("seed", 0), words.arguments, words.parameters, robot,
        time_limit=values.get("time_limit", TIME_LIMIT), keep=values.get("keep", FAILURES),
    )  # fmt: skip
    sweep = with_choices(sweep, values.get("worlds"), words.robots)
    return replace(sweep, design=values.get("design", default_design(sweep.factors)))


def _conditions(texts: list[str]) -> "list[Condition]":
    from missions.sweeps.claims import read_condition

    return [_read("--fail-if", read_condition, text) for text in texts]


def _read(option: str, read: "Callable[[str], T]", text: str) -> "T":
    """Read the value of an option, which errors name."""
    try:
        return read(text)
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


MOST_SHOWN = 10


def _print_runs(sweep: "Sweep") -> None:
    from stack.columns import columns

    names = [factor.name for factor in sweep.factors]
    runs = [sweep.plan.run(number) for number in range(min(sweep.runs, MOST_SHOWN))]
    typer.echo(f"{sweep.runs} runs of {sweep.mission}, {sweep.design}")
    rows = [[str(run.number), str(run.seed), *dict(run.settings).values()] for run in runs]
    for line in columns([["run", "seed", *names], *rows]):
        typer.echo(line)


def _summary(rows: "list[SweepRow]", folder: Path) -> list[str]:
    """Return the outcomes with their causes, the most frequent first."""
    from collections import Counter

    from missions.sweeps.progress import rate_text
    from stack.columns import columns

    found = Counter((row.outcome, row.cause or row.code) for row in rows)
    table = [[str(count), outcome, cause] for (outcome, cause), count in found.most_common()]
    different = [str(row.number) for row in rows if row.is_repeatable is False]
    notes = [f"not repeatable: the runs {', '.join(different)}"] if different else []
    return [
        rate_text(rows), *columns([["runs", "outcome", "cause"], *table]), *notes,
        f"{folder / 'runs.parquet'}; `treepilot sweep report {folder}` writes a page",
    ]  # fmt: skip


def _end(conditions: "Sequence[Condition]", rows: "Sequence[SweepRow]") -> None:
    """Exit with 1 if a condition holds."""
    for condition in conditions:
        tell(condition.describe(rows))
    if any(condition.holds(rows) for condition in conditions):
        raise typer.Exit(1)
