"""The bench of picking: its scenes, its watch, and a real run."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.simulated import SimulatedBody
from stack.body import BlockPose
from stack.types import Pose2D
from tests.benchmarks.arm_picking import ContactWatch, run_once, table_of
from tests.benchmarks.arm_scenes import GAP, SCENES, SIZES, Standing
from tests.stack.sim.arm_world import PANDA, bench, block, carry_out


@given(st.floats(-3.1, 3.1), st.floats(0.0, 0.2))
def test_the_gap_of_two_outlines_is_that_between_their_sides(heading, gap):
    """Two blocks of 5 cm side by side along a direction are apart by what lacks to 5 cm."""
    way = (0.05 + gap) * np.array([np.cos(heading), np.sin(heading)])
    one, other = Standing(0.4, 0.1, heading, SIZES[0]), Standing(*way, heading, SIZES[0])
    moved = Standing(0.4 + way[0], 0.1 + way[1], heading, SIZES[0])
    assert one.gap(moved) == pytest.approx(gap, abs=1e-9)
    assert other.gap(other) == 0.0


@pytest.mark.parametrize("seed", range(18))
def test_a_scene_has_its_blocks_apart_and_some_near_the_red_one(seed):
    scene = SCENES["pick"](seed)
    entries = scene.world["blocks"]
    assert len(entries) == seed % 6 + 1 and entries[0]["colour"] == [0.8, 0.1, 0.1]
    placed = [
        Standing(*it["at"][:2], np.radians(float(it["at"][2].split()[0])), tuple(it["size"]))
        for it in entries
    ]
    gaps = [[a.gap(b) for b in placed if b is not a] for a in placed]
    assert min((min(row) for row in gaps if row), default=1.0) > GAP - 2e-4  # 0.1 mm, rounded
    assert sum(gap < GAP + 2e-4 for gap in gaps[0]) >= min((seed % 6) // 2, 2)
    assert ("shadows" in scene.world) == (seed // 6 == 2)
    on_tray = [BlockPose((0.55, 0.404, 0.645), (0.0, 0.0, 0.0, 1.0))]
    beside = [BlockPose((0.55, 0.404, 0.625), (0.0, 0.0, 0.0, 1.0))]
    assert scene.error(on_tray) == pytest.approx(0.004) and scene.error(beside) == np.inf


def test_the_watch_notes_what_links_touch_but_not_what_fingers_hold():
    """A block that is not handled appears in the wrist."""
    scene = bench(block("red", x=0.307, size=(0.05, 0.05, 0.08)), block("blue", x=0.5))
    body = SimulatedBody(PANDA, scene, start=Pose2D(0.0, 0.0), seed=1)
    try:
        watch = ContactWatch(body, frozenset({1}))
        carry_out(body, 0.2)
        assert not watch.unintended
        engine = body._simulation._engine
        robot = engine._robots[0]
        wrist = max(robot._arm.links - robot._arm.fingers)
        at = engine.bullet.getLinkState(robot.body, wrist, physicsClientId=engine.client)[0]
        red = next(n for n, name in engine.scene.obstacles.items() if name == "red")
        engine.bullet.resetBasePositionAndOrientation(
            red, at, (0.0, 0.0, 0.0, 1.0), physicsClientId=engine.client
        )
        carry_out(body, 0.05)
        assert any("touches red" in name for name in watch.unintended)
    finally:
        body.close()


@pytest.mark.slow
def test_a_scene_with_near_blocks_in_uneven_light(tmp_path):
    row = run_once(SCENES["pick"](16), 16, tmp_path)
    assert row.about == "4 others, shadow"
    assert row.is_good, str(row)
    assert "1 of 1 as wanted (100 %)" in table_of([row])
