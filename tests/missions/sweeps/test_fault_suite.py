"""A suite of faults: which fit, what becomes of them, and the table."""

import pytest
from typer.testing import CliRunner

import missions
from missions.cli.app import app
from missions.execution.fit.faults import fault_files
from missions.sweeps.report.suite_page import suite_page
from missions.sweeps.row import SweepRow
from missions.sweeps.suite import (
    Cell,
    SuiteOptions,
    cells_of,
    fault_list,
    figures,
    plan_suite,
    table_lines,
)
from missions.sweeps.table import SweepFolder
from stack.errors import InputError


def test_faults_by_commas_and_the_suite():
    assert fault_list("push, none,gyro_bias+push,push") == ("push", "gyro_bias+push")
    assert fault_list("suite") == tuple(fault_files())
    for text in ("", "none", ","):
        with pytest.raises(InputError, match="it names no fault"):
            fault_list(text)
    with pytest.raises(InputError, match="no fault 'wet_flor'; did you mean 'wet_floor'"):
        fault_list("push,wet_flor")


def test_two_missions_of_one_name_are_an_error(turn):
    (turn.parent / "b").mkdir()
    other = turn.parent / "b" / turn.name
    other.write_text(turn.read_text())
    with pytest.raises(InputError, match="two missions are called turn"):
        plan_suite([str(turn), str(other)], ["push"], SuiteOptions())


def test_a_rate_that_is_no_number_is_an_error(turn):
    done = CliRunner().invoke(app, ["sweep", "--faults", "push", str(turn), "--fail-below", "nan"])
    assert isinstance(done.exception, InputError)


def test_only_what_fits_is_run(turn):
    suite = plan_suite([str(turn)], ["push", "closed_door"], SuiteOptions(seeds=2))
    (one,) = suite.sweeps
    assert one.sweep.factors[0].values == ("none", "push") and one.sweep.runs == 4
    assert "no doors" in one.unfit["closed_door"]
    with pytest.raises(InputError, match=r"no fault fits any of the missions: .*no doors"):
        plan_suite([str(turn)], ["closed_door"], SuiteOptions())
    with pytest.raises(InputError, match="its robot does not drive"):
        plan_suite(["50_pick_the_red_block"], ["push"], SuiteOptions())


def test_a_cell_is_as_good_as_its_worst_run():
    good, bad = SweepRow(0, 0, {}, "success"), SweepRow(1, 1, {}, "failure", reason="lost")
    touched = SweepRow(2, 2, {}, "success", collisions=1)
    assert [Cell(rows).word for rows in ((), (good,), (good, bad), (bad, touched))] == [
        "", "ok", "failure", "collision",
    ]  # fmt: skip
    assert (Cell((good, bad, touched)).successes, Cell((good, touched)).collisions) == (1, 1)


@pytest.mark.slow
def test_the_command_runs_and_its_rows_are_those_of_single_runs(turn, tmp_path):
    out = tmp_path / "out"
    faults = "push,link_loss,lidar_bias+gyro_bias,closed_door"
    words = ["sweep", "--faults", faults, str(turn), "--out", str(out), "--time-limit", "20s"]
    result = CliRunner().invoke(app, [*words, "--fail-below", "0.9"])
    assert result.exit_code == 1, result.output  # without commands it stands
    rows = {row.settings["faults"]: row for row in SweepFolder(out / "turn").rows(9)}
    assert {name: row.outcome for name, row in rows.items()} == {
        "none": "success", "push": "success", "link_loss": "failure",
        "lidar_bias+gyro_bias": "success",
    }  # fmt: skip
    for name in ("none", "push", "lidar_bias+gyro_bias"):  # all in one process, one after another
        assert missions.run(turn, seed=0, faults=name).log_sha256 == rows[name].event_hash
    suite = plan_suite([str(turn)], fault_list(faults), SuiteOptions(time_limit=20.0))
    cells = cells_of(suite, out)
    assert figures(suite, cells) == (2, 3, 0)
    assert list(table_lines(suite, cells))[1].split() == ["turn", "+", "+", "f", "+", "."]
    page = suite_page(suite, cells)
    assert page == (out / "faults.html").read_text() and "2 of 3 runs with a fault" in page
