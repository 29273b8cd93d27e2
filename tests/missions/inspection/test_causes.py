"""`treepilot diagnose` names the cause that was injected into a real run first."""

import ast
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.execution.running import run_mission
from missions.inspection import causes
from missions.inspection.causes.ranking import causes_of
from missions.inspection.causes.telling import lines_of, plain_of
from missions.inspection.page.story import read_story
from robots.simulated import SimulatedBody
from stack.telemetry.records import Command
from stack.types import Observation, Scan
from stack.types.limitations import OBSTACLE

ROOT = Path(__file__).parents[3]

HALL = """\
world: hall
format: 1
bounds: [-0.5, -0.5, 10.5, 4.5]
start: west
places: {west: [1.5, 2.0, 0 deg], east: [8.5, 2.0, 0 deg]}
walls:
  - {points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true}
  - {points: [[5, 0], [5, 1.3]]}
  - {points: [[5, 2.7], [5, 4]]}
boxes:
  - {name: shelf, at: [3.0, 3.7, 0 deg], size: [1.2, 0.5, 1.0]}
  - {name: bench, at: [7.6, 0.3, 0 deg], size: [1.4, 0.5, 1.0]}
"""
"""Two rooms of 5 x 4 m with an opening of 1.4 m between them."""

UNMAPPED = "  - {{name: {0}, at: [{1}, {2}, 0 deg], size: [{3}, {4}, 1.0], on_map: false}}\n"

MISSION = """\
mission: to the east
format: 1
robot: scout
world: ./hall.yaml
{head}run:
{tree}
"""
DRIVE = "  - navigate_to_pose: {goal: $east}\n    timeout: 60 s"


def unmapped(name, x, y, length, width):
    return UNMAPPED.format(name, x, y, length, width)


def mission(folder, tree=DRIVE, world=HALL, head=""):
    (folder / "hall.yaml").write_text(world, "utf-8")
    steps = "  sequence:\n" + "\n".join(f"  {line}" for line in tree.splitlines())
    (folder / "m.yaml").write_text(MISSION.format(head=head, tree=steps), "utf-8")
    return folder / "m.yaml"


def diagnosed(folder, *, make_body=None, parameters=None, **content):
    """Run a mission, and return the story with its causes."""
    options = RunOptions(seed=1, out=folder / "run", serve=False, parameters=parameters)
    run_mission(mission(folder, **content), options, make_body=make_body)
    story = read_story(folder / "run")
    return story, causes_of(story)


def first(folder, name, **content):
    """Return the first cause, which must be the injected one, and say the others if it is not."""
    story, found = diagnosed(folder, **content)
    names = [(cause.name, round(cause.strength, 2)) for cause in found]
    assert names and names[0][0] == name, (story.reason, names)
    assert found[0].facts
    assert found[0].advice
    return found[0]


class Faulty(SimulatedBody):
    """A simulated robot whose lidar has a fault from 3 s on."""

    @classmethod
    def made(cls, setup):
        return cls(setup.robot, setup.world, start=setup.start, seed=setup.seed)

    def sense(self):
        seen = super().sense()
        if seen.time < 3.0:
            return seen
        others = {n: one for n, one in seen.measurements.items() if not isinstance(one, Scan)}
        return Observation(seen.time, {**others, **self.scans(seen)})

    def scans(self, seen):
        return {}


class Lagging(Faulty):
    def scans(self, seen):
        self.kept = [*getattr(self, "kept", []), *seen.of(Scan).items()]
        due = [one for one in self.kept if one[1].stamp <= seen.time - 0.7]
        self.kept = [one for one in self.kept if one[1].stamp > seen.time - 0.7]
        return dict(due[-1:])


class Repeating(Faulty):
    """The lidar delivers its last scan again and again, with new stamps."""

    def scans(self, seen):
        new = seen.of(Scan)
        self.last = getattr(self, "last", new)
        return {n: replace(self.last[n], stamp=scan.stamp) for n, scan in new.items() if self.last}


class Behind(Faulty):
    """The clock of the lidar is 20 s behind that of the robot."""

    def scans(self, seen):
        return {n: replace(scan, stamp=scan.stamp - 20.0) for n, scan in seen.of(Scan).items()}


def test_the_documented_causes_are_those_of_the_code():
    said = set()
    for file in Path(causes.__file__).parent.glob("*.py"):
        for call in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "Cause":
                said |= {
                    node.value for node in ast.walk(call.args[0])
                    if isinstance(node, ast.Constant) and isinstance(node.value, str)
                } - {OBSTACLE, "held by "}  # fmt: skip
    table = (ROOT / "docs/runs.md").read_text("utf-8").partition("| cause | evidence |")[2]
    rows = [line.split("|")[1] for line in table.partition("\n\n")[0].splitlines()[2:]]
    documented = {name for row in rows for name in re.findall(r"`([a-z ]+)`", row)}
    assert said | {"held by zone"} == documented


def test_a_run_that_went_well_says_so(tmp_path):
    story, found = diagnosed(tmp_path)
    assert found == []
    assert list(lines_of(story, found))[-1] == "The run went well: there is nothing to explain."


def test_a_time_limit_that_is_too_short(tmp_path):
    cause = first(tmp_path, "time limit too short", tree=DRIVE.replace("60 s", "6 s"))
    # 7 m at about 0.6 m/s take about 13 s
    assert "m.yaml:7" in cause.advice


def test_enclosed_by_what_is_not_on_the_map(tmp_path):
    boxes = (
        unmapped("a", 1.0, 2.0, 0.1, 1.4) + unmapped("b", 2.0, 2.0, 0.1, 1.4)
        + unmapped("c", 1.5, 1.4, 1.0, 0.1) + unmapped("d", 1.5, 2.6, 1.0, 0.1)
    )  # fmt: skip
    first(tmp_path, "costmap full", world=HALL + boxes)


def test_a_costmap_without_the_layer_of_the_lidar(tmp_path):
    cause = first(
        tmp_path, "costmap empty", head="navigation: {costmap: {layers: [static]}}\n",
        world=HALL + unmapped("crate", 5.0, 2.0, 0.5, 1.2),
    )  # fmt: skip
    assert any("layers: static" in fact.text for fact in cause.facts)


def test_a_pallet_below_the_lidar_that_only_sonars_see(tmp_path):
    pallet = "  - {name: pallet, at: [5, 2, 0 deg], size: [0.5, 1.35, 0.1], on_map: false}\n"
    first(tmp_path, "costmap empty", world=HALL + pallet)


def test_a_goal_in_an_obstacle(tmp_path):
    first(
        tmp_path, "goal in an obstacle", head="blackboard: {spot: {type: Pose, optional: true}}\n",
        tree='  - set: {spot: "pose(7.6, 0.3, 0)"}\n  - navigate_to_pose: {goal: $spot}',
    )  # fmt: skip


def test_a_passage_that_is_too_narrow_on_the_map(tmp_path):
    narrow = HALL.replace("[5, 1.3]", "[5, 1.9]").replace("[5, 2.7]", "[5, 2.1]")
    tree = '  - set: {spot: "pose(8.5, 2.0, 0)"}\n  - navigate_to_pose: {goal: $spot}'
    head = "blackboard: {spot: {type: Pose, optional: true}}\n"
    first(tmp_path, "no way on the map", head=head, tree=tree, world=narrow)


def test_a_door_that_closes(tmp_path):
    door = (
        "doors:\n  - {name: gate, from: [5, 1.35], to: [5, 2.65]}\n"
        "timeline:\n  - {when: {near: [3, 2, 70 cm]}, close_door: gate}\n"
    )
    cause = first(tmp_path, "passage closed", world=HALL + door)
    assert "between 'west' and 'east'" in cause.sentence
    assert "the door 'gate'" in cause.sentence


def test_the_failure_that_a_fallback_deals_with_is_explained(tmp_path):
    tree = (
        "  - fallback:\n      - navigate_to_pose: {goal: $east}\n"
        "      - check: battery.charge < 0.5"
    )
    first(tmp_path, "passage closed", tree=tree, world=HALL + unmapped("crate", 5, 2, 0.4, 1.3))


def test_turns_of_a_recovery_are_not_why_a_door_is_closed(tmp_path):
    door = "doors:\n  - {name: gate, from: [5, 1.35], to: [5, 2.65], closed: true}\n"
    tree = (
        f"{DRIVE}\n    recover:\n      attempts: 3\n"
        "      round_robin: [{spin: {angle: 360 deg}}, {spin: {angle: 360 deg}}]"
    )
    first(tmp_path, "passage closed", world=HALL + door, tree=tree)


def test_a_passage_that_something_unmapped_closes(tmp_path):
    cause = first(tmp_path, "passage closed", world=HALL + unmapped("crate", 5.0, 2.0, 0.4, 1.3))
    assert "not on the map" in cause.sentence


def test_a_keep_out_zone_across_the_way(tmp_path):
    corners = "[[4, 0.1], [4.5, 0.1], [4.5, 3.9], [4, 3.9]]"
    zone = f"{{use: keepout, zones: [{{name: wet, corners: {corners}}}]}}"
    head = f"navigation: {{costmap: {{layers: [static, obstacle, {zone}]}}}}\n"
    cause = first(tmp_path, "passage closed", head=head)
    assert "the keep-out zone 'wet'" in cause.sentence


PLAIN = HALL[: HALL.index("boxes")]


def test_a_pose_that_is_wrong_and_sure(tmp_path):
    # Half a turn about the middle of the hall (5, 2) maps it onto itself.
    cause = first(
        tmp_path, "pose wrong", head="initial_pose: [8.5, 2.0, 180 deg]\n",
        world=PLAIN + "docks:\n  - {at: [8.5, 2.0]}\n",
        tree="  - navigate_to_pose: {goal: [7, 2.0, 180 deg]}\n"
        "  - wait_until: battery.charging\n    timeout: 5 s",
    )  # fmt: skip
    assert cause.strength == pytest.approx(0.8)  # 7 m off


def test_a_robot_that_was_carried_away(tmp_path):
    moved = "timeline:\n  - {when: {time: 4 s}, move_robot: [7.0, 3.2, 130 deg]}\n"
    refuse = {"navigator.ambiguous_goals": "refuse"}  # the drive would find its pose again
    cause = first(tmp_path, "moved by hand", world=HALL + moved, parameters=refuse)
    assert "relocalise" in cause.advice
    assert cause.facts[0].time == pytest.approx(4.0, abs=0.1)


def test_a_robot_that_turns_round_and_round(tmp_path):
    first(
        tmp_path, "spinning",
        tree="  - sequence:\n      - {spin: {angle: 180 deg}, repeat: 20}\n    timeout: 20 s",
    )  # fmt: skip


def test_a_lidar_that_falls_silent(tmp_path):
    cause = first(
        tmp_path, "sensor silent", make_body=Faulty.made, tree=DRIVE.replace("60 s", "9 s")
    )  # fmt: skip
    # the last scan of a lidar of 10 Hz before 3 s
    assert float(re.search(r"after (\S+) s", cause.sentence)[1]) == pytest.approx(2.95, abs=0.1)
    reason = read_story(tmp_path / "run").reason
    assert re.search(r"not finished after 9 s; held [56]\.\d of 9\.0 s: stopped: ", reason)


def test_scans_that_arrive_late(tmp_path):
    first(tmp_path, "scans late", make_body=Lagging.made, tree=DRIVE.replace("60 s", "15 s"))


def test_a_lidar_that_repeats_itself(tmp_path):
    cause = first(
        tmp_path, "sensor silent", make_body=Repeating.made, tree=DRIVE.replace("60 s", "15 s")
    )  # fmt: skip
    assert "repeats" in cause.sentence


def test_an_age_limit_below_the_period_of_the_lidar(tmp_path):
    cause = first(
        tmp_path, "setting does not fit", head="navigation: {safety: {stale_after: 5 ms}}\n",
        tree=DRIVE.replace("60 s", "9 s"),
    )  # fmt: skip
    assert "safety.stale_after 0.005 s" in cause.facts[0].text


def test_a_clock_that_is_wrong(tmp_path):
    first(tmp_path, "stamps wrong", make_body=Behind.made, tree=DRIVE.replace("60 s", "15 s"))


def test_wheels_that_slip(tmp_path):
    ice = "friction_zones:\n  - {from: [0, 0], to: [10, 4], friction: 0.0}\n"
    first(tmp_path, "wheel slip", world=HALL + ice, tree=DRIVE.replace("60 s", "40 s"))


def test_a_robot_that_slides_on_when_its_wheels_turn_it(tmp_path):
    # From 3 m on there is no grip: it keeps its speed, and its turn to the south is not done.
    ice = "friction_zones:\n  - {from: [3, 0], to: [10, 4], friction: 0.0}\n"
    tree = (
        "  - drive_on_heading: {distance: 2 m, speed: 0.6 m/s}\n"
        "  - spin: {angle: -90 deg}\n    timeout: 3 s"
    )
    cause = first(tmp_path, "wheel slip", world=HALL + ice, tree=tree)
    assert any("rad turned" in fact.text for fact in cause.facts)


def test_a_planner_that_gives_up(tmp_path):
    first(tmp_path, "planner too slow", head="navigation: {planner: {max_expansions: 30}}\n")


def test_a_robot_that_waits_for_its_plans(tmp_path):
    first(
        tmp_path, "planner too slow", parameters={"navigator.planning_latency": "30"},
        tree=DRIVE.replace("60 s", "15 s"),
    )  # fmt: skip


def test_a_person_in_the_way(tmp_path):
    person = (
        "people:\n  - {name: Ada, waypoints: [[5.0, 2.0], [5.2, 2.0]], pause: 500 s,"
        " speed: 0.5 m/s, radius: 45 cm}\n"
    )
    first(tmp_path, "held by a person", world=HALL + person)


def test_a_safety_zone_that_holds_the_robot(tmp_path):
    zone = (
        "navigation:\n  safety:\n    zones:\n      - {name: bumper, action: stop, radius: 90 cm}\n"
    )
    cause = first(tmp_path, "held by zone", head=zone)
    reason = read_story(tmp_path / "run").reason
    assert re.search(
        r"moved less than .* in 8 s; held [78]\.\d of 8\.0 s: stopped: .*bumper", reason
    )
    assert "bumper" in cause.facts[0].text


def test_a_zone_that_slows_the_robot_down(tmp_path):
    zone = "      - {name: near, action: slow_down, radius: 90 cm, ratio: 0.1}\n"
    head = f"navigation:\n  safety:\n    zones:\n{zone}"
    first(tmp_path, "held by zone", head=head, tree=DRIVE.replace("60 s", "15 s"))


def test_a_cruising_speed_that_is_too_low(tmp_path):
    head = "navigation: {controller: {cruise_speed: 5 cm/s}}\n"
    cause = first(
        tmp_path, "setting does not fit", head=head, tree=DRIVE.replace("60 s", "15 s")
    )  # fmt: skip
    assert "controller.cruise_speed 0.05 m/s; the robot's limit 0.8 m/s" in cause.facts[-1].text


def test_a_padding_that_closes_a_door(tmp_path):
    narrow = HALL.replace("[5, 1.3]", "[5, 1.6]").replace("[5, 2.7]", "[5, 2.4]")
    head = "navigation: {safety: {padding: 50 cm, tight_padding: 50 cm}}\n"
    cause = first(tmp_path, "setting does not fit", head=head, world=narrow)
    assert "safety.padding" in cause.sentence


def test_a_speed_that_the_robot_cannot_reach(tmp_path):
    cause = first(
        tmp_path, "setting does not fit",
        tree="  - drive_on_heading: {distance: 3 m, speed: 2 m/s}\n    timeout: 3 s",
    )  # fmt: skip
    assert "at most at 0.8 m/s" in cause.sentence


def test_a_run_that_was_killed(tmp_path):
    diagnosed(tmp_path)
    for name in ("snapshots.mcap", "events.jsonl"):
        file = tmp_path / "run" / name
        content = file.read_bytes()[: file.stat().st_size // 2]
        file.write_bytes(
            content if name.startswith("snap") else content[: content.rindex(b"\n") + 1]
        )
    (tmp_path / "run" / "report.json").unlink()
    (cause, *_) = causes_of(read_story(tmp_path / "run"))
    assert cause.name == "engine ended"


RAISES = """\
from treepilot import Behaviour


class Grip(Behaviour):
    def update(self):
        raise ValueError("no gripper")
"""


def test_an_exception_in_a_behaviour(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "grip.py").write_text(RAISES, "utf-8")
    cause = first(tmp_path, "exception", head="plugins: [./mine]\n", tree="  - grip: {}")
    assert "no gripper" in cause.sentence


def test_an_empty_battery(tmp_path):
    first(
        tmp_path, "battery empty",
        world=HALL + "timeline:\n  - {when: {time: 2 s}, battery: 0 %}\n",
        tree="  - wait: {time: 3 s}\n  - check: battery.charge > 0.1",
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["abort", "estop"])
def test_an_operator_who_ends_it(tmp_path, kind):
    options = RunOptions(seed=1, out=tmp_path / "run", serve=False)
    run = Run(prepare(mission(tmp_path), options), options)
    while run.engine.body.time < 3.0:
        run.step()
    run.engine.runtime.apply(Command("1", kind, {"reason": "enough"}))
    run.step()
    run.interrupt()
    run.finish()
    run.close()
    story = read_story(tmp_path / "run")
    (cause, *_) = causes_of(story)
    assert cause.name == "commanded"
    assert plain_of(story, [cause])["causes"][0]["strength"] == 1.0


def test_the_json_has_the_line_of_the_mission_that_failed(tmp_path):
    story, found = diagnosed(tmp_path, tree=DRIVE.replace("60 s", "3 s"))
    failed = json.loads(json.dumps(plain_of(story, found)))["failed"]
    assert (failed["where"], failed["code"]) == ("m.yaml:7", "TIMED_OUT")
    assert failed["line"] == "- navigate_to_pose: {goal: $east}"
