"""One run as a function: the same as `treepilot run`, and its row."""

from __future__ import annotations

import pytest

import missions
from missions.inspection.run_folders import is_run_folder
from missions.sweeps.checking import checked
from missions.sweeps.design import RunDescription
from missions.sweeps.factors import read_factor
from missions.sweeps.sweep import Sweep
from missions.sweeps.sweep_file import EMPTY
from missions.sweeps.worker import RunMaker, SweepInputs
from robots.load import find_robot
from stack.errors import InputError


def maker(tmp_path, mission, **changes):
    sweep = Sweep(str(mission), 10, "random", **changes)
    return RunMaker(SweepInputs(sweep, tmp_path / "sweep" / "runs"))


def test_runs_in_a_reused_engine_are_those_of_treepilot_run(tmp_path, turn):
    """In any order, also after another setting and another scene."""
    make = maker(tmp_path, turn, keep="none")
    made = [
        make(RunDescription(number, seed, settings))
        for number, (seed, settings) in enumerate(
            [(3, ()), (4, ()), (3, ()), (3, (("angle", "20 deg"),)), (3, ())]
        )
    ]
    assert [row.outcome for row in made] == ["success"] * 5
    assert made[0].event_hash == made[2].event_hash == made[4].event_hash
    for row, arguments in ((made[1], {}), (made[3], {"angle": "20 deg"}), (made[4], {})):
        alone = missions.run(turn, seed=row.seed, arguments=arguments)
        assert row.event_hash == alone.log_sha256
        assert (row.seconds, row.collisions) == (
            pytest.approx(alone.simulated_seconds, abs=1e-3),
            0,
        )
    assert len({row.event_hash for row in made}) == 3


def test_a_failure_has_code_node_cause_and_records(tmp_path, turn):
    row = maker(tmp_path, turn)(RunDescription(7, 1, (("goal", "$window"),)))
    assert (row.outcome, row.code) == ("failure", "TIMED_OUT")
    assert row.node and row.cause == "time limit too short"
    assert row.is_repeatable is True
    assert row.folder == "runs/00007" and is_run_folder(tmp_path / "sweep" / row.folder)


def test_what_is_kept(tmp_path, turn):
    good, bad = RunDescription(0, 0), RunDescription(1, 0, (("goal", "$window"),))
    for keep, kept in (("all", [True, True]), ("failures", [False, True]), ("none", [False] * 2)):
        folder = tmp_path / keep
        make = maker(folder, turn, keep=keep)
        rows = [make(good), make(bad)]
        assert [bool(row.folder) for row in rows] == kept
        there = sorted(path.name for path in (folder / "sweep").glob("runs/*"))
        assert there == [name for name, is_kept in zip(("00000", "00001"), kept, strict=True)
                         if is_kept]  # fmt: skip
        assert rows[1].cause == "time limit too short"


def test_a_time_limit_is_an_outcome(tmp_path, turn):
    row = maker(tmp_path, turn, keep="none", time_limit=0.5)(RunDescription(0, 0))
    assert (row.outcome, row.reason) == ("time limit", "not finished after 0.5 s")
    assert row.is_repeatable is True and row.cause != "commanded"


def test_a_refused_combination_is_no_failure_of_the_robot(tmp_path, turn):
    row = maker(tmp_path, turn)(RunDescription(0, 0, (("times", "9"),)))
    assert row.outcome == "refused" and not row.counts and "9" in row.reason


def test_a_failure_without_records_is_a_failure(tmp_path, turn):
    """A file in the place of the folder: no records can be written, as on a full disk."""
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "runs").touch()
    row = maker(tmp_path, turn)(RunDescription(0, 1, (("goal", "$window"),)))
    assert (row.outcome, row.folder, row.is_repeatable) == ("failure", "", None)
    assert row.seconds and row.counts


@pytest.mark.parametrize("keep", ["all", "failures"])
def test_a_failure_without_a_cause_is_a_failure(tmp_path, turn, monkeypatch, keep):
    """Its records cannot be read, or have no snapshot."""

    def broken(_):
        raise InputError("no snapshot")

    monkeypatch.setattr("missions.sweeps.worker.read_story", broken)
    row = maker(tmp_path, turn, keep=keep)(RunDescription(0, 1, (("goal", "$window"),)))
    assert (row.outcome, row.cause, row.folder) == ("failure", "", "runs/00000")


def test_a_mission_that_keeps_values_begins_each_run_with_the_initial_ones(tmp_path, turn):
    turn.write_text(
        "mission: count\nrobot: scout\nworld: small_room\n"
        "blackboard: {runs: {type: int, initial: 0, keep: true}}\n"
        "run:\n  sequence:\n    - set: {runs: $runs + 1}\n    - say: {text: '{runs}'}\n"
    )
    make = maker(tmp_path, turn, keep="all")
    rows = [make(RunDescription(number, 0)) for number in (0, 1, 1)]
    assert [row.outcome for row in rows] == ["success"] * 3
    assert len({row.event_hash for row in rows}) == 1


def errors(sweep):
    with pytest.raises(InputError) as error:
        checked(sweep, EMPTY.refusal)
    return str(error.value)


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("angel", "1,2", "has no argument 'angel'; did you mean 'angle'"),
        ("times", "1,9", "--vary times: 9 is refused: "),
        ("times", "uniform(1, 9)", "--vary times: 9 is refused: "),
        ("controller.cruise_sped", "0.3", "did you mean"),
        ("controller.cruise_speed", "normal(0.5, 0.3)", "cut at 3 deviations: -0.4"),
        ("world", "small_room,atlantis", "--vary world: atlantis is refused: "),
        ("robot", "scuot", "did you mean"),
        ("start", "nowhere", "--vary start: nowhere is refused"),
    ],
)
def test_a_bad_factor_is_an_error_before_anything_runs(turn, name, values, words):
    sweep = Sweep(str(turn), 10, "random", (read_factor(name, values),))
    assert words in errors(sweep)


@pytest.mark.parametrize(
    ("name", "fixed"),
    [
        ("times", {"arguments": {"times": "2"}}), ("robot", {"robot": "scout"}),
        ("controller.cruise_speed", {"parameters": {"controller.cruise_speed": "2"}}),
    ],
)  # fmt: skip
def test_a_factor_with_one_value_for_all_runs_is_an_error(turn, name, fixed):
    sweep = Sweep(str(turn), 10, "random", (read_factor(name, "1,2"),), **fixed)
    assert f"--vary {name}: it is also " in errors(sweep)


def test_seeds_fit_into_the_table(turn):
    assert "the largest seed is" in errors(Sweep(str(turn), 10, "random", (), 2**63 - 5))


def test_whole_numbers_are_recognised(turn):
    factors = (read_factor("times", "uniform(1, 3)"),
               read_factor("controller.cruise_speed", "uniform(0.3, 0.5)"))  # fmt: skip
    ready = checked(Sweep(str(turn), 10, "random", factors), EMPTY.refusal)
    assert [factor.whole for factor in ready.sweep.factors] == [True, False]
    assert {dict(run.settings)["times"] for run in ready.sweep.descriptions()} == {"1", "2", "3"}


def test_starts_are_places_and_poses(turn):
    factor = read_factor("start", "dock,[2, 2.5, 90 deg]")
    ready = checked(Sweep(str(turn), 2, "grid", (factor,)), EMPTY.refusal)
    assert "turn.yaml" in ready.files and "missions/worlds/small_room.yaml" in ready.files


def test_a_grid_needs_lists_and_enough_runs(turn):
    assert "needs lists" in errors(
        Sweep(str(turn), 9, "grid", (read_factor("times", "uniform(1, 3)"),))
    )
    two = (read_factor("times", "1,2"), read_factor("angle", "1,2"))
    assert "4 combinations, but only 3 runs" in errors(Sweep(str(turn), 3, "grid", two))


def test_a_real_robot_is_never_swept(tmp_path, turn):
    scout = find_robot("scout", tmp_path).parent
    text = (scout / "robot.yaml").read_text("utf-8")
    text = text.replace("urdf: scout.urdf", f"urdf: {scout / 'scout.urdf'}")
    (tmp_path / "robot.yaml").write_text(f"{text}\nbody: scripted\n", "utf-8")
    turn.write_text(turn.read_text().replace("robot: scout", "robot: ./robot.yaml"))
    assert "a sweep runs simulations" in errors(Sweep(str(turn), 2, "random"))
