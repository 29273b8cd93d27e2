"""The HTML report tells what happened in a run, and needs nothing else."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from missions.inspection.page.map_figure import map_figure
from missions.inspection.page.page import page_of
from missions.inspection.page.plots import plot
from missions.inspection.page.story import read_story
from stack.errors import InputError
from stack.telemetry.records import Event

VOID = {"meta", "line", "circle", "rect", "image", "path", "polyline", "br", "link"}

MISSION = """\
mission: three <b>ways</b> & a wall
format: 1
robot: scout
world: small_room
blackboard: {spot: {type: Pose, optional: true}}
navigation: {controller: {cruise_speed: 0.5}}
run:
  sequence:
    - navigate_to_pose: {goal: [2.0, 1.2, 0]}
      name: first way
      timeout: 30 s
    - set: {spot: "pose(3.4, 1.2, 0)"}
    - navigate_to_pose: {goal: $spot}    # inside the table
      name: into the table
"""


class Checker(HTMLParser):
    """Notes tags that do not close, and everything that would be fetched."""

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.texts = [], [], []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            if name in ("src", "href") and not value.startswith("data:image/png;base64,"):
                self.fetched.append(value)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    base = tmp_path_factory.mktemp("report")
    (base / "walk.yaml").write_text(MISSION)
    for seed in (1, 2):
        run_mission(base / "walk.yaml", RunOptions(seed=seed, out=base / f"run {seed}"))
    return base


@pytest.fixture(scope="module")
def story(runs):
    return read_story(runs / "run 1")


def checked(page):
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    assert checker.fetched == []
    assert "<script" not in page
    assert "url(" not in page
    return " ".join(checker.texts)


@pytest.mark.slow
def test_the_page_tells_outcome_cause_and_line(story):
    text = checked(page_of([story]))
    assert "three <b>ways</b> & a wall" in text
    assert "failure" in text
    assert "into the table" in text
    assert "walk.yaml:13" in text
    assert "navigate_to_pose: {goal: $spot}    # inside the table" in text
    row = " ".join(text[text.index("controller.cruise_speed") :].split()[:7])
    assert row == "controller.cruise_speed 0.5 m/s default 0.8 m/s set"  # pure pursuit: 0.8 m/s
    assert "set by walk.yaml:6" in " ".join(text.split())
    assert story.report["log_sha256"][:16] in text


@pytest.mark.slow
def test_a_failure_is_told_once_and_the_headline_tells_its_cause(story):
    """The drive and the mission tell it as events too; the mark on the map has it as tooltip."""
    (failing,) = story.failures.every
    assert sum(failing.message in event.text for event in story.events) >= 2
    page = re.sub("<title>.*?</title>", "", page_of([story]))
    text = checked(page)
    assert text.count(failing.message) == 1
    assert "into the table: GOAL_OCCUPIED, because the goal is in an obstacle of the map" in text
    assert "<title>run 1: failure, goal in an obstacle</title>" in page_of([story])


@pytest.mark.slow
def test_the_story_is_that_of_the_run(story):
    assert story.status == "failure"
    (failing,) = story.failures.every
    assert failing.name == "into the table"
    assert failing.message
    samples = story.samples
    assert (samples.x[-1], samples.y[-1]) == pytest.approx(
        tuple(story.report["final_pose"]["estimate"][axis] for axis in "xy")
    )
    assert samples.speed.max() <= 0.55  # the mission's cruise speed is 0.5 m/s
    assert samples.error.max() < 0.2
    names = {node.name: bars for _, node, bars in story.bars}
    assert names["first way"][0].outcome == "success"
    assert names["into the table"][0].outcome == "failure"
    assert names["first way"][0].end <= names["into the table"][0].begin + 0.2


@pytest.mark.slow
@pytest.mark.parametrize(("apart", "drawn"), [(0.2, False), (0.5, True)])  # 0.3 m is the limit
def test_the_map_shows_the_true_way_where_the_estimate_is_wrong(story, apart, drawn):
    samples = story.samples
    shifted = replace(samples, true_x=samples.x + apart, error=0 * samples.error + apart)
    drawing = map_figure(replace(story, samples=shifted))
    assert ("true way" in drawing) is drawn
    assert ('class="truth" points' in drawing) is drawn


@pytest.mark.slow
def test_the_map_marks_where_the_robot_was_lifted(story):
    assert "moved" not in map_figure(story)
    lifted = Event(0, 0, 5.0, "info", "simulation", "lifted", "the robot was lifted")
    moved = replace(story, trace=replace(story.trace, events=(*story.events, lifted)))
    assert "5.0 s: the robot was lifted" in map_figure(moved)
    happened = "<td>the robot was lifted</td>"
    assert (happened in page_of([moved]), happened in page_of([story])) == (True, False)


HALL = """\
world: hall
format: 1
start: [1, 1, 0]
places: {west: [1, 1, 0 deg], east: [7, 1, 0 deg]}
walls:
  - {points: [[0, 0], [8, 0], [8, 2], [0, 2]], closed: true}
  - {points: [[4, 0], [4, 0.5]]}
  - {points: [[4, 1.5], [4, 2]]}
"""
IN_THE_WAY = {
    "Ada": """\
people:
  - {name: Ada, waypoints: [[5.5, 1.7], [4, 1]], speed: 0.6 m/s, pause: 20 s, start: 0.3}
""",
    "gate": """\
doors: [{name: gate, from: [4, 0.5], to: [4, 1.5]}]
timeline: [{when: {time: 0.5 s}, close_door: gate}]
""",
}
THROUGH = """\
mission: through
robot: scout
world: hall.yaml
start: west
run: {navigate_to_pose: {goal: $east}, timeout: 20 s}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "label"), [("gate", "closed at 0.5 s"), ("Ada", "there from [0-9.]+ s")]
)
def test_the_map_names_the_door_or_person_that_blocked_at_its_place(tmp_path, name, label):
    """Both are in the passage at (4, 1), which is 1 m wide."""
    (tmp_path / "hall.yaml").write_text(HALL + IN_THE_WAY[name])
    (tmp_path / "through.yaml").write_text(THROUGH)
    run_mission(tmp_path / "through.yaml", RunOptions(seed=1, out=tmp_path / "run"))
    story = read_story(tmp_path / "run")
    blocker = next(one for one in story.blockers if one.name == name)
    assert np.hypot(blocker.at[0] - 4.0, blocker.at[1] - 1.0) < 0.6
    assert blocker.time > 1.0
    assert re.search(f">{name}</tspan><tspan [^>]*>{label}</tspan>", map_figure(story))


@pytest.mark.slow
def test_the_true_speed_is_that_of_the_truth_and_not_of_a_lift(story):
    samples = story.samples
    straight = replace(
        samples, time=np.arange(5.0), true_x=np.array([0.0, 0.5, 1.0, 9.0, 9.5]), true_y=np.zeros(5)
    )
    np.testing.assert_array_equal(straight.true_speed, [np.nan, 0.5, 0.5, np.nan, 0.5])


@pytest.mark.parametrize(
    ("highest", "top"), [(0.803, "1"), (1.46, "1.5"), (67.5, "80"), (2.3, "2.5")]
)
def test_a_scale_ends_at_a_round_number(highest, top):
    """By hand: a multiple of 1, 2 or 5 times a power of ten that is at least a fifth of it."""
    drawn = plot("Speed", "m/s", [("", np.arange(2.0), np.array([0.0, highest]), "red")], 1.0)
    assert f">{top}</text>" in drawn


@pytest.mark.slow
def test_two_runs_stand_side_by_side_with_their_first_difference(runs, story):
    other = read_story(runs / "run 2")
    text = checked(page_of([story, other]))
    assert "run 1" in text
    assert "run 2" in text
    assert re.search(r"; bit by bit they are equal up to \d+\.\d\d s \(event \d+, \w+\)", text)
    assert "the two runs are equal, event by event" in checked(page_of([story, story]))


@pytest.mark.slow
def test_a_killed_run_has_a_page(runs, tmp_path):
    content = (runs / "run 1" / "snapshots.mcap").read_bytes()
    (tmp_path / "snapshots.mcap").write_bytes(content[: len(content) // 2])
    lines = (runs / "run 1" / "events.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "events.jsonl").write_bytes(b"".join(lines[: len(lines) // 2]))
    (tmp_path / "mission.yaml").write_text(MISSION)
    text = checked(page_of([read_story(tmp_path)]))
    assert "it ended without a report" in text


def test_a_folder_without_records_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"no events\.jsonl"):
        read_story(tmp_path)
