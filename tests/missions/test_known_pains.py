"""What users of today's navigation stacks suffer from, and the tests that it does not happen here.

Each complaint has its number in the tracker of Nav2 (n), slam_toolbox (s) or the old navigation
stack (o). Tests name those that they rule out: `@pytest.mark.pain("n1655")`; `pytest -m pain`
runs them all. Those that belong to no package's own tests are below.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import missions

TESTS = Path(__file__).parents[1]

PAINS = {
    "a spin above half a turn never ends": "n1655",
    "backing up never ends when blocked": "n2453",
    "inflation closes a door that the robot fits through": "n5625",
    "paths hug the walls": "n4808 n6100",
    "a misplaced or misspelt parameter goes unnoticed": "n4049 n5189",
    "a value is silently overridden elsewhere": "n3111",
    "wall time and simulated time mix": "n3746 n3352",
    "bring-up hangs without a word": "n6556 n2917 n2491 n4960",
    "nobody can watch the tree live": "n2696 n3770",
    "a faulty tree crashes the navigator": "n3180 n3508 n2847",
    "it drives to a cancelled goal": "n3090",
    "planning fails for a goal that can be reached": "n4655 o18",
    "it wobbles on the way": "n5531 n5375",
    "it swings about the goal": "n4921 n1492",
    "ghosts in the costmap": "n4043 n3661 n2915",
    "system tests are flaky": "n4349 n1733 n1509 n2797",
    "messages hide the cause": "s720 s543 s465",
    "the pose gets worse and nobody notices": "s334 s769 s285 s771",
    "localisation believes a wrong initial pose": "n341",
}

Test = ast.FunctionDef | ast.AsyncFunctionDef


def marked() -> Iterator[tuple[str, Test, set[str]]]:
    """File, function and complaints of every test that bears the mark."""
    for file in sorted(TESTS.rglob("test_*.py")):
        for item in ast.parse(file.read_text("utf-8")).body:
            if isinstance(item, Test) and item.name.startswith("test_"):
                if found := {text for mark in item.decorator_list for text in complaints(mark)}:
                    yield file.relative_to(TESTS).as_posix(), item, found


def complaints(mark: ast.expr) -> Iterator[str]:
    if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.pain":
        yield from (ast.literal_eval(argument) for argument in mark.args)


def surely_asserted(body: list[ast.stmt]) -> bool:
    """Whether something is asserted that no `if` can leave out."""
    for item in body:
        if isinstance(item, ast.Assert):
            return True
        if isinstance(item, ast.With):
            expected = any("pytest.raises" in ast.unparse(each) for each in item.items)
            if expected or surely_asserted(item.body):
                return True
        if isinstance(item, ast.For | ast.Try) and surely_asserted(item.body):
            return True
    return False


def test_every_pain_is_ruled_out_by_a_test_and_every_mark_is_known() -> None:
    known = {number for numbers in PAINS.values() for number in numbers.split()}
    assert {number for _, _, numbers in marked() for number in numbers} == known


def test_a_test_that_rules_out_a_pain_always_runs_and_always_asserts() -> None:
    for file, test, _ in marked():
        marks = " ".join(ast.unparse(mark) for mark in test.decorator_list)
        assert "skip" not in marks and "xfail" not in marks, f"{file}: {test.name}"
        assert surely_asserted(test.body), f"{file}: {test.name}"


LOST = """
mission: a
robot: scout
world: office
start: dock
initial_pose: [{x}, {y}, {heading} deg]
run:
  navigate_to_pose: {{goal: $meeting}}
  recover: {{attempts: 3, round_robin: [relocalise, {{spin: 360 deg}}]}}
"""


@pytest.mark.pain("n341")
@pytest.mark.parametrize(("x", "y", "heading"), [(1.3, 5.0, 0), (1.1, 5.3, 15), (5.8, 5.0, 180)])
def test_a_wrong_initial_pose_is_noticed_and_mended(
    x: float, y: float, heading: float, tmp_path: Path
) -> None:
    """The dock is at (0.8, 5.0, 0): half a metre off, a bit and 15 degrees, 5 m and half a turn."""
    path = tmp_path / "lost.yaml"
    path.write_text(LOST.format(x=x, y=y, heading=heading), "utf-8")
    report = missions.run(path, seed=1)
    assert (report.status, report.collisions) == ("success", 0)
    end = report.final_pose
    assert abs(end["estimate"]["x"] - end["truth"]["x"]) < 0.1


STRAIGHT = """
mission: a
robot: scout
world: two_corridors
start: [1.5, 7.6, 0 deg]
navigation: {{controller: {controller}}}
run: {{navigate_to_pose: {{goal: [6.5, 7.6, 0 deg], tolerance: 0.1}}}}
"""
CONTROLLERS = ("pure_pursuit", "mppi", "dwb", "graceful")


@pytest.fixture(scope="module", params=CONTROLLERS)
def straight_way(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> list[tuple[float, float, float]]:
    """(x, y, heading) of the truth at every control step of five metres straight on."""
    folder = tmp_path_factory.mktemp(request.param)
    path = folder / "straight.yaml"
    path.write_text(STRAIGHT.format(controller=request.param), "utf-8")
    return driven(path)


def driven(path: Path) -> list[tuple[float, float, float]]:
    from missions.execution.build import build, run_info
    from missions.execution.prepare import RunOptions, prepare
    from stack.telemetry.hub import Telemetry

    options = RunOptions(serve=False)
    plan = prepare(path, options)
    engine = build(plan, options, Telemetry(run_info(plan, "a", 0)), None)
    poses = []
    try:
        while not engine.runtime.state.is_over:
            engine.runtime.step()
            pose = engine.body.truth.pose
            poses.append((pose.x, pose.y, pose.heading))
    finally:
        engine.runtime.parts.navigator.close()
        engine.body.close()
    assert engine.runtime.state == "success", engine.runtime.reason
    return poses


def swings(values: list[float], least: float) -> int:
    """How often a value turns back by more than `least`."""
    count, direction, farthest = 0, 0, values[0]
    for value in values:
        change = value - farthest
        if direction == 0 and abs(change) > least:
            direction, farthest = (1 if change > 0.0 else -1), value
        elif change * direction > 0.0:
            farthest = value
        elif -change * direction > least:
            count, direction, farthest = count + 1, -direction, value
    return count


@pytest.mark.pain("n5531", "n5375")
def test_nothing_wobbles_on_a_straight_way(
    straight_way: list[tuple[float, float, float]],
) -> None:
    """At most two swings of the heading by more than 3 degrees, over five metres."""
    assert swings([heading for _, _, heading in straight_way], 0.05) <= 2


@pytest.mark.pain("n4921", "n1492")
def test_the_goal_is_met_and_not_swung_about(
    straight_way: list[tuple[float, float, float]],
) -> None:
    x, y, heading = straight_way[-1]
    assert ((x - 6.5) ** 2 + (y - 7.6) ** 2) ** 0.5 < 0.12  # the tolerance and 2 cm of estimate
    assert abs(heading) < 0.2
    last_metre = [x for x, _, _ in straight_way if x > 5.5]
    assert swings(last_metre, 0.02) == 0
