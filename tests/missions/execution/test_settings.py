"""Settings under `navigation` that reach their parts: rates, local costmap, memory, odometry."""

import pytest

from missions.execution.component_choices import SETTINGS
from missions.execution.prepare import RunOptions, diagnose, prepare
from stack.components import GROUPS, available, component
from stack.drivetrain.limits import Limits
from stack.errors import FrameError, InputError, ParameterError
from stack.parameters import build, declarations
from stack.perception.camera_lease import CameraLease
from tests.missions.execution.live_run import HEAD, LiveRun

RUN = "run: {wait: 5 s}\n"


@pytest.fixture
def live(tmp_path):
    """A run on the scripted body with settings, before its first step."""

    def start(settings):
        head = f"{HEAD}navigation: {{{settings}}}\n"
        return LiveRun(tmp_path, RUN, head=head, body="scripted")

    return start


def test_the_rates_of_control_and_tree_are_settings(live):
    run = live("loop: {control_rate: 40 Hz, tree_rate: 20 Hz}")
    run.steps(8)
    assert run.runtime.parts.body.time == pytest.approx(8 / 40)
    assert run.runtime.stages.timings()["tree"].count == 4


@pytest.mark.parametrize(
    ("loop", "sentence"),
    [
        ("{control_rate: 25}", "4:20 error[E111] tree_rate: 10 Hz does not divide control_rate "
         "25 Hz; choose a rate that does"),
        ("{control_rate: 30}", "4:35 error[E111] the control period 0.0333333 s is not "
         "a multiple of the physics period 0.002 s"),
        ("{control_rate: 2}", "4:35 error[E111] control_rate: 2 Hz must be at least 10 Hz"),
    ],
)  # fmt: skip
def test_rates_that_do_not_fit_are_found_where_they_stand(tmp_path, loop, sentence):
    path = tmp_path / "m.yaml"
    path.write_text(f"{HEAD}navigation: {{loop: {loop}}}\n{RUN}", "utf-8")
    with pytest.raises(InputError) as caught:
        prepare(path, RunOptions())
    assert f"{path}:{sentence}" in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "found"),
    [
        ("safety: {tight_speed: 0.8, padding_speed: 0.3}",
         "4:36 E111 tight_speed: 0.8 m/s is above padding_speed 0.3 m/s"),
        ("safety: {padding_speed: 0.1}",
         "4:38 E111 padding_speed: 0.1 m/s is less than tight_speed 0.15 m/s"),
        ("controller: {cruise_speed: 2 m/s}",
         "4:41 W141 controller.cruise_speed: 2 m/s is limited to 0.8 m/s by the robot scout"),
        ("navigator: {spin_speed: 2 rad/s}",
         "4:38 W141 navigator.spin_speed: 2 rad/s is limited to 1.8 rad/s by the robot scout"),
        ("controller: {use: dwb, reverse_speed: 0.4}",
         "4:52 W141 controller.reverse_speed: 0.4 m/s is limited to 0.3 m/s by the robot scout"),
        ("safety: {padding_speed: 0}", ""),
        ("controller: {cruise_speed: 0.8}", ""),
    ],
)  # fmt: skip
def test_values_that_contradict_each_other_or_the_robot_are_found(tmp_path, settings, found):
    path = tmp_path / "m.yaml"
    path.write_text(f"{HEAD}navigation: {{{settings}}}\n{RUN}", "utf-8")
    findings = diagnose(path).findings
    assert [
        f"{item.mark.line}:{item.mark.column} {item.code} {item.sentence}" for item in findings
    ] == ([found] if found else [])


def test_only_what_the_mission_sets_is_compared_with_the_robot(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(f"{HEAD}navigation: {{controller: {{cruise_speed: 2}}}}\n{RUN}", "utf-8")
    given = RunOptions(parameters={"controller.cruise_speed": "0.5"})
    assert diagnose(path, given).findings == ()
    given = RunOptions(parameters={"controller.use": "dwb"})  # keeps the speed
    assert [item.code for item in diagnose(path, given).findings] == ["W141"]
    assert diagnose(path, RunOptions(robot="jackal")).findings == ()  # 2 m/s


def test_the_command_line_and_live_tuning_refuse_a_contradiction(live, tmp_path):
    tuning = live("safety: {tight_speed: 0.1}").runtime.parts.live_parameters
    with pytest.raises(ParameterError, match=r"0.05 m/s is less than tight_speed 0.1 m/s"):
        tuning.change("safety.padding_speed", 0.05)
    tuning.change("safety.padding_speed", 0.1)
    with pytest.raises(InputError, match=r"--parameter safety.tight_speed: 2 m/s is above"):
        prepare(tmp_path / "lively.yaml", RunOptions(parameters={"safety.tight_speed": "2"}))


def test_every_relation_names_a_parameter_and_holds_for_the_defaults():
    classes = [*SETTINGS.values()]
    for kind in GROUPS:
        classes += [component(kind, where).Parameters for where in available(kind).values()]
    related = 0
    for parameters in classes:
        build(parameters, {})
        declared = declarations(parameters)
        for item in declared.values():
            related += bool(item.not_above) + bool(item.robot_limit)
            assert not item.not_above or declared[item.not_above].unit == item.unit
            assert not item.robot_limit or item.robot_limit in declarations(Limits)
    assert related >= 20


def test_only_the_simulation_asks_for_a_multiple_of_its_step(live):
    assert live("loop: {control_rate: 30}").runtime.period == pytest.approx(1 / 30)


def test_the_local_costmap_has_the_size_that_is_set(live):
    parts = live("costmap: {local_size: 3 m}").runtime.parts
    grid = parts.perceiver.world_model.local_costmap.grid
    assert grid.cells.shape[0] * grid.resolution == pytest.approx(3.0, abs=2 * grid.resolution)
    with pytest.raises(ParameterError, match="cannot be changed during a run"):
        parts.live_parameters.change("local_costmap.local_size", 4.0)


def test_settings_reach_obstacle_memory_and_the_history_of_poses(live):
    run = live("obstacle_memory: {blind_time: 4 s}, "
               "loop: {pose_history: 1 s}")  # fmt: skip
    parts = run.runtime.parts
    assert parts.perceiver.obstacle_memory.parameters.blind_time == 4.0
    run.steps(41)  # 2 s
    now = parts.perceiver.frames.newest
    parts.perceiver.frames.pose_at("odom", now - 0.95)
    with pytest.raises(FrameError):
        parts.perceiver.frames.pose_at("odom", now - 1.2)
    parts.live_parameters.change("obstacle_memory.blind_time", 2.0)
    assert parts.perceiver.obstacle_memory.parameters.blind_time == 2.0


def test_the_camera_stays_on_for_the_time_of_a_request():
    lease = CameraLease(0.4)
    lease.renew(1.0)
    assert lease.is_active(1.39) and not lease.is_active(1.41)
