"""Settings under `navigation` that reach their parts: rates, local costmap, memory, odometry."""

import pytest

from missions.execution.prepare import RunOptions, prepare
from stack.errors import FrameError, InputError, ParameterError
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
        ("{control_rate: 2}", "4:35 error[E111] control_rate: 2 Hz must be at least 5 Hz"),
    ],
)  # fmt: skip
def test_rates_that_do_not_fit_are_found_where_they_stand(tmp_path, loop, sentence):
    path = tmp_path / "m.yaml"
    path.write_text(f"{HEAD}navigation: {{loop: {loop}}}\n{RUN}", "utf-8")
    with pytest.raises(InputError) as caught:
        prepare(path, RunOptions())
    assert f"{path}:{sentence}" in str(caught.value)


def test_only_the_simulation_asks_for_a_multiple_of_its_step(live):
    assert live("loop: {control_rate: 30}").runtime.period == pytest.approx(1 / 30)


def test_the_local_costmap_has_the_size_that_is_set(live):
    parts = live("costmap: {local_size: 3 m}").runtime.parts
    grid = parts.world_model.local_costmap.grid
    assert grid.cells.shape[0] * grid.resolution == pytest.approx(3.0, abs=2 * grid.resolution)
    with pytest.raises(ParameterError, match="cannot be changed during a run"):
        parts.facade.set_parameter("local_costmap.local_size", 4.0)


def test_settings_reach_obstacle_memory_and_the_history_of_poses(live):
    run = live("obstacle_memory: {blind_time: 4 s}, "
               "loop: {pose_history: 1 s}")  # fmt: skip
    parts = run.runtime.parts
    assert parts.obstacle_memory.parameters.blind_time == 4.0
    run.steps(41)  # 2 s
    now = parts.frames.newest
    parts.frames.pose_at("odom", now - 0.95)
    with pytest.raises(FrameError):
        parts.frames.pose_at("odom", now - 1.2)
    parts.facade.set_parameter("obstacle_memory.blind_time", 2.0)
    assert parts.obstacle_memory.parameters.blind_time == 2.0


def test_the_camera_stays_on_for_the_time_of_a_request():
    lease = CameraLease(0.4)
    lease.renew(1.0)
    assert lease.is_active(1.39) and not lease.is_active(1.41)
