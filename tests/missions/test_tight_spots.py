"""Recoveries in PyBullet: wedged between crates, lost, with a costmap full of junk, shut in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import missions
from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from stack.streams import stream
from stack.types import OCCUPIED, OccupancyGrid, Pose2D
from tests.benchmarks.missions import Trace
from tests.stack.mapping.written_maps import write_ros_map

SCOUT, JACKAL = (0.22, 0.22), (0.254, 0.215)
"""Half length and half width, metres."""

CENTRE = Pose2D(3.0, 2.5)
WORLD = """world: wedge
format: 1
bounds: [-0.5, -0.5, 6.5, 5.5]
start: [1, 4, 0]
walls:
  - {{points: [[0, 0], [6, 0], [6, 5], [0, 5]], closed: true}}
boxes:
{boxes}
"""
MISSION = """mission: wedged
format: 1
robot: {robot}
world: ./world.yaml
start: [{x:.4f}, {y:.4f}, {heading:.4f}]
initial_pose: unknown
navigation: {{navigator: {{lost_motions: drive}}}}  # an escape needs no pose
{head}
run:
  sequence:
{steps}
"""
ESCAPE = "    - free_space_escape: {}\n      timeout: 2 min"


def crates(half: tuple[float, float], gaps: dict[str, float], heading: float) -> str:
    """Boxes round a robot at CENTRE that faces `heading`, with these gaps to its sides."""
    length, width = half
    places = {
        "ahead": ((length + gaps.get("ahead", 0) + 0.15, 0.0), (0.3, 2 * width)),
        "behind": ((-length - gaps.get("behind", 0) - 0.15, 0.0), (0.3, 2 * width)),
        "left": ((0.0, width + gaps.get("left", 0) + 0.15), (2 * length, 0.3)),
        "right": ((0.0, -width - gaps.get("right", 0) - 0.15), (2 * length, 0.3)),
    }
    rows = []
    for side in gaps:
        (x, y), (long, wide) = places[side]
        pose = Pose2D(CENTRE.x, CENTRE.y, heading).compose(Pose2D(x, y))
        rows.append(
            f"  - {{name: {side}, at: [{pose.x:.4f}, {pose.y:.4f}, {heading:.4f}], "
            f"size: [{long:.3f}, {wide:.3f}, 0.6], on_map: false}}"
        )
    return "\n".join(rows)


def run(folder: Path, boxes: str, start: Pose2D, seed: int, **text: str):
    """Run a mission of some steps among boxes; the report and its trace."""
    (folder / "world.yaml").write_text(WORLD.format(boxes=boxes), "utf-8")
    filled = {"robot": "scout", "head": "", "steps": ESCAPE, **text}
    path = folder / "wedged.yaml"
    place = {"x": start.x, "y": start.y, "heading": start.heading}
    path.write_text(MISSION.format(**place, **filled), "utf-8")
    trace = Trace()
    return run_mission(str(path), RunOptions(seed=seed, serve=False), [trace]), trace


def freed(trace: Trace) -> float:
    """Metres that the robot is from where it was wedged."""
    return trace.truths[-1].distance_to(CENTRE)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_a_robot_between_crates_on_three_sides_gets_out_without_knowing_where_it_is(tmp_path, seed):
    draw = stream(seed, "wedge")
    heading = float(draw.uniform(-np.pi, np.pi))
    sides = ["ahead", "left", "right", "behind"]
    sides.pop(int(draw.integers(4)))
    boxes = crates(SCOUT, dict.fromkeys(sides, 0.05), heading)
    facing = float(draw.uniform(-np.pi, np.pi))  # a round robot's need not be the crates' heading
    report, trace = run(tmp_path, boxes, Pose2D(CENTRE.x, CENTRE.y, facing), seed)
    assert (report.status, report.reason) == ("success", "")
    assert (report.collisions, report.pushed_into) == (0, 0)
    assert report.min_clearance_m > 0.02
    assert freed(trace) > 0.25  # with a crate's half side behind its own rim, it cannot be nearer


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_robot_in_a_corner_gets_out(tmp_path, seed):
    heading = float(stream(seed, "corner").uniform(-np.pi, np.pi))
    start = Pose2D(0.05 + 0.22 + 0.05, 0.05 + 0.22 + 0.05, heading)
    far = "  - {name: far, at: [4, 3, 0], size: [0.5, 0.5, 0.5]}"
    report, trace = run(tmp_path, far, start, seed)
    assert (report.status, report.collisions) == ("success", 0)
    there = trace.truths[-1]
    assert min(there.x, there.y) - 0.05 - 0.22 > 0.13


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_robot_that_sees_nothing_behind_backs_out_the_way_it_came(tmp_path, seed):
    """The jackal's lidar is blind behind it; it may only go where it has just been."""
    boxes = crates(JACKAL, {"ahead": 0.05, "left": 0.07, "right": 0.07}, 0.0)
    start = Pose2D(CENTRE.x - 1.0, CENTRE.y, 0.0)
    steps = "    - drive_for: {time: 7 s, linear: 0.2}\n" + ESCAPE
    report, trace = run(tmp_path, boxes, start, seed, robot="jackal", steps=steps)
    assert (report.status, report.reason, report.collisions) == ("success", "", 0)
    deepest = min(trace.truths, key=CENTRE.distance_to)
    assert CENTRE.distance_to(deepest) < 0.15
    assert freed(trace) > CENTRE.distance_to(deepest) + 0.15


def test_a_robot_put_where_it_has_seen_nothing_behind_stays(tmp_path):
    boxes = crates(JACKAL, {"ahead": 0.05, "left": 0.05, "right": 0.05}, 0.0)
    report, trace = run(tmp_path, boxes, CENTRE, 1, robot="jackal")
    assert report.status == "failure"
    assert "COLLISION_AHEAD" in report.reason
    assert freed(trace) < 0.02


def test_a_costmap_full_of_junk_does_not_matter(tmp_path):
    cells = np.full((60, 70), OCCUPIED, dtype=np.int8)
    write_ros_map(OccupancyGrid(cells, 0.1, (-0.5, -0.5)), tmp_path / "junk.yaml")
    boxes = crates(SCOUT, {"ahead": 0.05, "left": 0.05, "right": 0.05}, 0.0)
    report, trace = run(tmp_path, boxes, CENTRE, 1, head="map: ./junk.yaml")
    assert (report.status, report.collisions) == ("success", 0)
    assert freed(trace) > 0.25


def test_a_robot_that_is_shut_in_fails_in_time(tmp_path):
    boxes = crates(SCOUT, dict.fromkeys(["ahead", "behind", "left", "right"], 0.03), 0.0)
    report, trace = run(tmp_path, boxes, CENTRE, 1)
    assert report.status == "failure"
    assert "COLLISION_AHEAD obstacles block every motion" in report.reason
    assert report.simulated_seconds < 5.0
    assert (report.collisions, freed(trace) < 0.02) == (0, True)


@pytest.mark.slow
def test_the_mission_of_the_tight_spot_succeeds_with_another_seed():
    """test_runs.py runs it with seed 1, `make bench` with many more."""
    report = missions.run("10_tight_spot", seed=2)
    assert (report.status, report.reason, report.collisions) == ("success", "", 0)
