"""A mission that is saved while it runs is reloaded once the robot has stopped, if it is valid."""

import pytest

from stack.telemetry.records import MissionState
from tests.missions.execution.live_run import LiveRun

DRIVE = """
    blackboard: {drives: {type: int, initial: 0}}
    arguments: {goal: {type: Pose, default: [5.0, 3.8, 90 deg]}}
    run:
      sequence:
        - set: {drives: $drives + 1}
        - navigate_to_pose: {goal: $goal}
          name: there
        - say: done
"""
LONGER = DRIVE.replace("- say: done", "- say: done\n        - say: twice")


@pytest.fixture
def run(tmp_path, live_run):
    return live_run(tmp_path, DRIVE)


def test_a_good_file_starts_from_its_root_once_the_robot_stands(run):
    run.steps(40)
    assert run.speed > 0.2
    run.save(LONGER)
    saved = run.until("saved")
    assert run.speed > 0.2  # it is noticed on the way; nobody waits for it to stand
    assert run.engine.tree.outcome == "idle"  # and halted at once
    reload = run.until("reload")
    assert reload.step > saved.step
    assert run.speed < 0.05  # at most one step into the new drive
    assert reload.text == "tree 2 starts from its root; kept drives = 1"
    assert [event.kind for event in run.kept.events].count("tree") == 2
    assert len(run.snapshot.tree) == 5
    assert run.snapshot.debugging.generation == 1
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
    assert run.texts("say") == ["done", "twice"]
    assert run.snapshot.blackboard == {"drives": "2"}  # it went over, then the root counted again


def test_a_faulty_file_is_reported_in_full_and_the_old_tree_goes_on(run):
    run.steps(20)
    run.save(DRIVE.replace("name: there", "nam: there").replace("$goal}", "$gaol}"))
    refused = run.until("reload_refused")
    assert refused.level == "error"
    assert len(refused.fields["findings"]) == 2
    assert run.texts("finding")[0].startswith("lively.yaml:10:")
    assert run.snapshot.debugging.faults == tuple(refused.fields["findings"])
    run.steps(10)
    assert run.speed > 0.2
    run.save(LONGER)
    run.until("reload")
    assert run.snapshot.debugging.faults == ()


def test_a_half_written_file_is_left_alone_until_it_is_whole(run):
    whole = run.file.read_text() + "# more\n"
    for part in range(0, len(whole), 16):  # 4 looks a second, and each time it has changed
        run.file.write_text(whole[:part])
        run.steps(2)
    assert not run.texts("saved", "reload_refused")
    run.file.write_text(whole)
    assert run.until("saved").fields["files"] == ["lively.yaml"]


def test_a_deleted_file_is_missed_and_taken_when_it_is_back(run):
    run.file.unlink()
    refused = run.until("reload_refused")
    assert refused.fields["findings"] == ["lively.yaml was deleted; save it again"]
    run.steps(30)
    assert len(run.texts("reload_refused")) == 1
    run.save(LONGER)
    run.until("reload")


def test_what_cannot_be_replaced_is_said_and_the_rest_is_taken(run):
    text = LONGER + "    start: [2.0, 2.0, 0]\n    initial_pose: unknown\n"
    text += "    navigation: {planner: {use: lattice}, controller: {cruise_speed: 0.3}}\n"
    try:
        run.save(text)
        reload = run.until("reload")
    except AssertionError:
        pytest.fail(str(run.texts("finding")))
    assert reload.level == "warning"
    assert reload.fields["next_run"] == ["initial_pose unknown", "start", "planner lattice"]
    assert run.runtime.parts.live_parameters.current()["controller.cruise_speed"] == 0.3
    assert len(run.snapshot.tree) == 5


def test_settings_that_cannot_change_during_a_run_are_named(run):
    run.steps(20)
    zones = "[{corners: [[0, 0], [1, 0], [1, 1]]}]"
    run.save(
        LONGER + f"    navigation: {{tracker: {{forget: 2 s}}, speed_limits: {{zones: {zones}}}}}\n"
    )
    reload = run.until("reload")
    assert reload.level == "warning"
    assert sorted(reload.fields["next_run"]) == ["speed_limits.zones", "tracker.forget"]


def test_a_file_saved_again_before_the_robot_stands_loses_nothing(run):
    """The first of two files is never run, so what changed is counted from the one before it."""
    slow = LONGER + "    navigation: {planner: {use: lattice}, controller: {cruise_speed: 0.3}}\n"
    run.steps(40)
    run.save(slow)
    run.until("saved")
    run.runtime.step = lambda: None  # the robot takes its time to stand
    run.save(slow.replace("say: twice", "say: three times"))
    run.until("saved")
    del run.runtime.step
    reload = run.until("reload")
    assert reload.fields["next_run"] == ["planner lattice"]
    assert run.runtime.parts.live_parameters.current()["controller.cruise_speed"] == 0.3
    assert run.texts("reload") == [reload.text]


def test_includes_and_parameter_files_are_watched_too(tmp_path, live_run):
    included = """
        trees:
          greet: {do: {say: hello}}
    """
    text = """
        include: [trees.yaml]
        parameters: [slow.yaml]
        run: {sequence: [{wait: {time: 5 s}}, {use: greet}]}
    """
    folder = tmp_path / "both"
    folder.mkdir()
    (folder / "slow.yaml").write_text("controller: {cruise_speed: 0.4}\n")
    (folder / "trees.yaml").write_text("trees:\n  greet: {do: {say: hello}}\n")
    run = live_run(folder, text)
    run.save(included.replace("hello", "hi there"), "trees.yaml")
    assert run.until("saved").fields["files"] == ["trees.yaml"]
    run.steps(2)
    run.save("controller: {cruise_speed: 0.2}", "slow.yaml")
    run.until("reload")
    assert run.runtime.parts.live_parameters.current()["controller.cruise_speed"] == 0.2
    run.save("controller: {cruise_speed: fast}", "slow.yaml")
    assert "slow.yaml:1:" in run.until("finding").text
    run.until("mission_ended")
    assert run.texts("say") == ["hi there"]


def test_arguments_given_stay(tmp_path, live_run):
    run = live_run(tmp_path, DRIVE, arguments={"goal": "[1.6, 1.0, 0]"})
    run.steps(4)
    run.save(LONGER)
    run.until("mission_ended")
    assert abs(run.snapshot.pose.x - 1.6) < 0.3


def test_a_paused_mission_takes_the_file_and_stays_paused(run):
    run.steps(20)
    assert run.order("pause").done
    run.save(LONGER)
    run.until("reload")
    assert run.runtime.state is MissionState.PAUSED
    assert {row.status for row in run.snapshot.tree} == {"idle"}
    run.order("resume")
    run.until("mission_ended")
    assert run.texts("say") == ["done", "twice"]


def test_breakpoints_survive_and_lost_ones_are_told(run):
    run.order("break", node="there")
    run.order("force", node="say", status="success")
    run.save(DRIVE.replace("- say: done", "- wait: 0.1 s"))
    reload = run.until("reload")
    assert reload.fields["lost"] == ["sequence/say"]
    assert run.snapshot.reason == "the mission was reloaded; step or continue"
    run.order("continue")
    assert run.until("breakpoint").text.startswith(
        "stopped before the start of 'there' (lively.yaml:10)"
    )


def logged(folder):
    run = LiveRun(folder, DRIVE)
    run.steps(30)
    run.save(LONGER)
    run.steps(30)
    run.save("run: nothing")
    run.steps(30)
    run.order("break", node="there")
    run.until("mission_ended") if run.runtime.state is not MissionState.PAUSED else None
    run.close()
    return run.telemetry.log_sha256


def test_the_same_saves_at_the_same_steps_give_the_same_log(tmp_path):
    assert logged(tmp_path / "one") == logged(tmp_path / "two")
