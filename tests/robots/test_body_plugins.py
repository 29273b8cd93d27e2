"""Bodies of installed packages: entry points of `treepilot.bodies`."""

from pathlib import Path

import pytest

import missions
from robots.bodies import GROUP
from robots.load import read_robot
from stack.errors import InputError

SCOUT = Path(__file__).parents[2] / "robots" / "scout"

PLUGIN = """
from dataclasses import dataclass

from robots.bodies import BodyKind, NoParameters
from robots.scripted import ScriptedBody
from stack.parameters import parameter

made = []


@dataclass(frozen=True)
class CrawlerParameters:
    gain: float = parameter(1.0, above=0.0, help="share of the commanded velocity")


class Crawler(BodyKind):
    Parameters = CrawlerParameters

    @staticmethod
    def make(setup, parameters):
        made.append(parameters)
        return ScriptedBody(setup.robot, start=setup.start)


class Unrelated:
    pass
"""


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A site-packages folder with the plugin installed in it."""
    (tmp_path / "crawler_body.py").write_text(PLUGIN)
    metadata = tmp_path / "crawler_body-0.1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: crawler_body\nVersion: 0.1\n")
    entries = "crawler = crawler_body:Crawler\nodd = crawler_body:Unrelated\ngone = crawler_no:A"
    (metadata / "entry_points.txt").write_text(f"[{GROUP}]\n{entries}\n")
    monkeypatch.syspath_prepend(tmp_path)


def robot_file(folder, body):
    text = (SCOUT / "robot.yaml").read_text().replace("scout.urdf", str(SCOUT / "scout.urdf"))
    file = folder / "robot.yaml"
    file.write_text(f"{text}\nbody: {body}\n")
    return file


def mission(folder):
    file = folder / "wait.yaml"
    file.write_text(
        "mission: wait\nformat: 1\nrobot: ./robot.yaml\nworld: small_room\n"
        "localisation: dead_reckoning\nrun: {wait: {time: 0.2 s}}\n"
    )
    return file


def test_the_robot_file_chooses_a_body_and_sets_its_parameters(site, tmp_path):
    robot_file(tmp_path, "{use: crawler, gain: 0.5}")
    report = missions.run(mission(tmp_path))
    assert (report.status, report.final_pose["truth"]) == ("success", None)
    import crawler_body

    assert [parameters.gain for parameters in crawler_body.made] == [0.5]
    crawler_body.made.clear()
    missions.run(mission(tmp_path), body="scripted")
    assert crawler_body.made == []


def test_the_command_line_s_choice_has_the_defaults(site, tmp_path):
    robot_file(tmp_path, "simulated")
    import crawler_body

    crawler_body.made.clear()
    missions.run(mission(tmp_path), body="crawler")
    assert [parameters.gain for parameters in crawler_body.made] == [1.0]


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("crawlr", "there is no body 'crawlr'; did you mean 'crawler'"),
        ("{use: crawler, gian: 1.0}", "gian"),
        ("{use: crawler, gain: -1.0}", "gain"),
        ("{gain: 1.0}", "body must be a name, or a mapping with `use`"),
        ("odd", "does not inherit BodyKind"),
        ("gone", "the body 'gone' cannot be used: No module named 'crawler_no'"),
    ],
)
def test_a_wrong_choice_is_an_error_in_the_robot_file(site, tmp_path, body, sentence):
    with pytest.raises(InputError, match=sentence):
        read_robot(robot_file(tmp_path, body))


def test_an_unknown_body_of_the_command_line_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(InputError, match="no body 'simulatd'; did you mean 'simulated'"):
        missions.run("01_drive_to_a_point", body="simulatd", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_body_in_the_plugins_of_a_mission_is_refused_with_what_to_do(tmp_path):
    """A robot file is read without a mission: it knows installed bodies only."""
    robot_file(tmp_path, "mine")
    (tmp_path / "mine.py").write_text(PLUGIN.replace("Crawler(", "Mine("))
    file = mission(tmp_path)
    file.write_text(f"{file.read_text()}plugins: [./mine.py]\n")
    with pytest.raises(InputError) as refused:
        missions.run(file)
    (finding,) = refused.value.findings
    assert finding.sentence == (
        "there is no body 'mine'; available: mavlink, scripted, simulated, wheels; a body of your "
        f"own is an installed package with the entry point `mine` of `{GROUP}`"
    )


def test_robots_whose_body_is_in_no_simulation_do_not_share_a_world(site):
    from missions.execution.prepare import RunOptions
    from missions.execution.shared_world import prepare_together

    with pytest.raises(InputError, match="is crawler; robots in one world must be simulated"):
        prepare_together(["23_courier", "24_second_courier"], RunOptions(body="crawler"))
