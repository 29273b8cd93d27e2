"""Estimators chosen by the mission: by name, with parameters, from a plugin, without a map."""

from textwrap import dedent

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.inspection.component_scaffold import new_component
from missions.inspection.listing import description_of, installed, rows_of
from missions.inspection.parameter_sources import parameters_of
from robots.load import find_robot
from stack.errors import InputError, ParameterError
from stack.types import Pose2D
from tests.missions.execution.live_run import LiveRun

HEAD = "mission: m\nrobot: scout\nworld: small_room\n"
RUN = "run: {wait: 5 s}\n"


@pytest.fixture
def mission(tmp_path):
    def write(text):
        path = tmp_path / "m.yaml"
        path.write_text(HEAD + dedent(text) + RUN, "utf-8")
        return path

    return write


def chosen(path, **parameters):
    given = {name.replace("__", "."): value for name, value in parameters.items()}
    return prepare(path, RunOptions(parameters=given)).choices["localisation"]


def live(folder, text, **options):
    """A running mission on the scripted body, three control steps after its start."""
    run = LiveRun(folder, RUN, head=HEAD + dedent(text), body="scripted", **options)
    run.steps(3)
    return run


def test_the_default_depends_on_the_map(mission):
    assert chosen(mission("")).name == "mcl"
    path = mission("map: none\n")
    assert chosen(path).name == "dead_reckoning"
    sources = {item.name: item.source for item in parameters_of(str(path))}
    assert sources["localisation.use"] == "default without a map"


def test_a_mission_names_an_estimator_and_sets_its_parameters(mission):
    choice = chosen(mission("localisation: {use: mcl, max_particles: 900, min_particles: 400}\n"))
    assert (choice.parameters.max_particles, choice.parameters.min_particles) == (900, 400)
    assert chosen(mission("localisation: dead_reckoning\n")).name == "dead_reckoning"


def test_the_command_line_chooses_and_sets_parameters(mission):
    path = mission("localisation: {max_particles: 900}\n")
    assert chosen(path, localisation__max_particles="500").parameters.max_particles == 500
    assert chosen(path, localisation__use="dead_reckoning").name == "dead_reckoning"
    with pytest.raises(InputError, match=r"--parameter localisation.use: .*needs a map"):
        chosen(mission("map: none\n"), localisation__use="mcl")


def test_the_robot_file_sets_parameters_that_the_mission_overrides(mission, tmp_path):
    scout = find_robot("scout", tmp_path)
    text = scout.read_text("utf-8") + "localisation: {max_particles: 700, beams: 30}\n"
    (tmp_path / "robot.yaml").write_text(text.replace("scout.urdf", f"{scout.parent}/scout.urdf"))
    path = mission("localisation: {beams: 40}\n")
    choices = prepare(path, RunOptions(robot=str(tmp_path / "robot.yaml"))).choices
    parameters = choices["localisation"].parameters
    assert (parameters.max_particles, parameters.beams) == (700, 40)


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("localisation: mlc\n", "E111 4:15 there is no estimator 'mlc'; did you mean 'mcl'?"),
        ("localisation: {max_partcles: 9}\n", "E111 4:30 max_partcles: there is no parameter "
         "'max_partcles' here; did you mean 'max_particles'?"),
        ("localisation: {lost_health: 2}\n", "E111 4:29 lost_health: 2 must be at most 1"),
        ("localisation: {initial_position_deviation: 3 s}\n",
         "E111 4:44 initial_position_deviation: '3 s' is in s"),
        ("localisation: {max_particles: 100}\n",
         "E111 4:31 max_particles: 100 is less than min_particles 300; use at least 300"),
        ("localisation: 3\n", "E101 4:15 localisation must be a name or {use: name"),
        ("localisation: {lidar: rear}\n", "E111 4:15 scout has no lidar 'rear'"),
        ("localisation: mcl\nmap: none\n", "E111 4:15 use: the estimator 'mcl' needs a map, and "
         "this mission has `map: none`; use `dead_reckoning`, or give the mission a map"),
        ("map: none\nlocalisation: {use: mcl}\n", "E111 5:21 use: the estimator 'mcl' needs a map"),
        ("initial_pose: unknown\nlocalisation: dead_reckoning\n",
         "E111 4:15 the estimator 'dead_reckoning' cannot find an unknown initial pose; use"),
        ("navigation: {localisation: mcl}\n", "E111 4:28 `localisation` does not belong to "
         "`navigation`; write it beside `navigation`, at the top of the mission"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_found_where_it_stands(mission, text, finding):
    with pytest.raises(InputError) as caught:
        prepare(mission(text), RunOptions())
    [found] = caught.value.findings
    hint = f"; {found.hint}" if found.hint else ""
    line = f"{found.code} {found.mark.line}:{found.mark.column} {found.sentence}{hint}"
    assert line.startswith(finding)


def test_a_parameter_file_sets_the_estimator(mission, tmp_path):
    (tmp_path / "outdoor.yaml").write_text("localisation: {use: mcl, beams: 90}\n", "utf-8")
    assert chosen(mission("parameters: [outdoor.yaml]\n")).parameters.beams == 90


def test_estimators_are_listed_and_described():
    names = dict(rows_of("estimators", installed()))
    assert list(names) == ["mcl", "dead_reckoning", "slam", "pose_graph"]
    assert names["mcl"].startswith("Monte-Carlo localisation")
    assert "max_particles" in description_of("mcl", installed())


def test_an_estimator_of_a_plugin_locates_the_robot(tmp_path):
    new_component("estimator", "by_wheels", tmp_path / "my_plugins")
    text = """
        plugins: [./my_plugins]
        start: [1.5, 2.0, 0]
        localisation: {use: by_wheels, drift: 1}
        """
    run = live(tmp_path, text)
    estimator = run.runtime.parts.perceiver.estimator
    assert type(estimator).__name__ == "ByWheels" and estimator.parameters.drift == 1.0
    assert estimator.estimate.pose == Pose2D(1.5, 2.0)
    assert "by_wheels" in dict(rows_of("estimators", installed(str(run.file))))


def test_dead_reckoning_on_a_map_keeps_the_map(tmp_path):
    run = live(tmp_path, "localisation: dead_reckoning\nstart: [1.5, 2.0, 0]\n")
    parts = run.runtime.parts
    assert parts.perceiver.estimator.estimate.pose == Pose2D(1.5, 2.0)
    assert (parts.perceiver.map_layer.content.cells == 100).any()


def test_parameters_of_the_estimator_change_during_a_run(tmp_path):
    run = live(tmp_path, "localisation: {initial_position_deviation: 3 cm}\n")
    parts = run.runtime.parts
    deviation = parts.perceiver.estimator.estimate.position_deviation
    assert deviation < 0.06  # of a hundred particles or more, drawn with 3 cm
    parts.live_parameters.change("localisation.max_particles", 350)
    parts.robot.localisation.set_pose(
        Pose2D(1.5, 2.0), position_deviation=2.0, heading_deviation=1.0, source="test"
    )
    assert len(parts.perceiver.estimator.particles) == 350  # a spread of 2 m asks for more
    with pytest.raises(ParameterError, match="max_particles"):
        parts.live_parameters.change("localisation.max_particles", 100)


def test_a_saved_parameter_of_the_estimator_applies_at_once(tmp_path):
    run = live(tmp_path, "localisation: {max_particles: 900}\n")
    run.head = run.head.replace("900", "800")
    run.save(RUN)
    run.steps(20)
    assert run.runtime.parts.perceiver.estimator.parameters.max_particles == 800


def test_behaviours_get_the_scans_of_the_lidar_that_localises(tmp_path):
    text = find_robot("scout", tmp_path).read_text("utf-8").replace("scout.urdf", "URDF")
    text = text.replace("URDF", str(find_robot("scout", tmp_path).parent / "scout.urdf"))
    rear = "lidars: {rear: {position: [-0.1, 0], yaw: 180 deg, beams: 90, range_max: 7}}\n"
    (tmp_path / "robot.yaml").write_text(text + rear, "utf-8")
    run = live(tmp_path, "localisation: {lidar: rear}\n", robot=str(tmp_path / "robot.yaml"))
    assert run.runtime.parts.robot.perception.scan.range_max == 7.0
    with pytest.raises(InputError, match="has no lidar 'raer'; did you mean 'rear'"):
        run.runtime.parts.live_parameters.change("localisation.lidar", "raer")
    run.runtime.parts.live_parameters.change("localisation.lidar", "")
    assert run.runtime.parts.robot.perception.scan.range_max != 7.0


def test_a_mission_chooses_the_odometry_and_its_sources(tmp_path, mission):
    text = """
    odometry:
      use: ekf
      gyro_timeout: 300 ms
      sources: [{sensor: flow, twist: [linear], gate: 3}]
    """
    choice = prepare(mission(text), RunOptions()).choices["odometry"]
    assert (choice.name, choice.parameters.gyro_timeout) == ("ekf", 0.3)
    (source,) = choice.parameters.sources
    assert (source.sensor, source.twist, source.gate) == ("flow", ("linear",), 3.0)
    parts = live(tmp_path, "odometry: {use: wheels_gyro, gyro_timeout: 0.3}\n").runtime.parts
    assert type(parts.perceiver.odometry).__name__ == "WheelGyroOdometry"
    parts.live_parameters.change("odometry.gyro_timeout", 0.2)
    assert parts.perceiver.odometry.parameters.gyro_timeout == 0.2


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("{use: ekf, sources: [{sensor: a, pose: [z]}]}", "'z' is not one of x, y, heading"),
        ("{use: ekf, sources: [{sensor: a}]}", "the source 'a' has neither pose nor twist"),
        (
            "{use: ekf, sources: [{sensor: a, twist: [linear]}, {sensor: a, pose: [x]}]}",
            "listed twice",
        ),
        ("{use: efk}", "there is no odometry fusion 'efk'; did you mean 'ekf'"),
        ("{gyro_timeot: 1}", "did you mean 'gyro_timeout'"),
    ],
)
def test_wrong_settings_of_the_odometry_are_findings(mission, given, sentence):
    with pytest.raises(InputError, match=sentence):
        prepare(mission(f"odometry: {given}\n"), RunOptions())


def test_odometry_does_not_belong_to_navigation(mission):
    with pytest.raises(InputError, match="`odometry` does not belong to `navigation`"):
        prepare(mission("navigation: {odometry: ekf}\n"), RunOptions())
