"""The arm in the dashboard: vitals, charts, and the map from above."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest
from rich.text import Text

from stack.telemetry.records import AROUND_ARM, Layer, SceneShape
from stack.types import ArmView, HeldBlock, Pose2D
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.panes.chart import Chart
from tui.panes.map_pane import MapPane
from tui.panes.vitals_pane import VitalsPane, arm_lines

TOOL = np.eye(4)
TOOL[:3, 3] = 0.307, -0.1, 1.083
ARM = ArmView(
    ("a", "b", "c"), np.array([-1.0, 0.5, 2.0]), np.array([-1.0, -1.0, -1.0]),
    np.array([2.0, 2.0, 2.0]), False, TOOL, "", 0.04, 0.08, 12.4,
    links=np.array([[0.0, 0.0, 0.6], [0.0, 0.0, 0.9], TOOL[:3, 3]]),
    way=np.array([TOOL[:3, 3], [0.5, 0.3, 0.8]]),
    held=HeldBlock(TOOL, np.array([0.05, 0.05, 0.05]), (1.0, 0.0, 0.0)),
)  # fmt: skip


def shown(arm):
    text = Text()
    arm_lines(text, arm)
    return text.plain.splitlines()


def test_joints_tool_and_gripper_have_a_line_each():
    """Lower limit, middle (level 4 of 0 to 7, rounded to even) and upper limit of three joints."""
    joints, tool, gripper = shown(ARM)
    assert joints == "arm      ▁▅█ at rest"
    assert tool == "tool     0.31 -0.10 1.08 m"
    assert gripper == "gripper  ━━━━━━━━━━ 40 mm 12 N"


@pytest.mark.parametrize(
    ("changed", "told"),
    [({"moving": True}, "moving"), ({"problem": "b: it is 0.2 off"}, "b: it is 0.2 off")],
)
def test_an_arm_that_moves_or_has_stopped_says_so(changed, told):
    assert shown(replace(ARM, **changed))[0].endswith(f" {told}")


def test_an_arm_without_a_gripper_has_no_line_for_it():
    assert len(shown(replace(ARM, width_max=0.0))) == 2


class Arm(SampleSource):
    """The sample run, with an arm.

    Args:
        drives: whether the robot has wheels too.
    """

    def __init__(self, drives):
        super().__init__()
        self.info = replace(self.info, drives=drives)

    def poll(self):
        snapshot = super().poll()
        beside = snapshot.pose.compose(Pose2D(0.4, 0.4))
        blue = SceneShape("box", beside, (0.2, 0.2, 0.1), (0.0, 0.0, 1.0))
        layers = {**snapshot.layers, AROUND_ARM: Layer(1, (blue,))}
        return replace(snapshot, arm=ARM, layers=layers)


def dashboard(drives):
    """Titles of the charts, text of the vitals, and the map pane."""

    async def look():
        app = Dashboard(Arm(drives), live=False)
        async with app.run_test(size=(150, 44)) as pilot:
            app.refresh_now()
            await pilot.pause()
            charts = [str(chart.border_title) for chart in app.query(Chart) if chart.display]
            return charts, app.query_one(VitalsPane)._shown.plain, app.query_one(MapPane)

    return asyncio.run(look())


def test_an_arm_without_wheels_has_no_figures_of_driving():
    charts, vitals, plan = dashboard(drives=False)
    assert [title.split()[0] for title in charts] == ["Joints", "Gripper", "Grip"]
    assert not any(word in vitals for word in ("speed", "health", "driven", "error"))
    canvas = plan._canvas
    assert 0x0000FF in canvas.foreground and 0xFF0000 in canvas.foreground  # a box, what it holds
    around = canvas.view.metres_per_dot * min(canvas.columns * 2, canvas.rows * 4)
    assert around == pytest.approx(2.2, rel=0.1)  # twice REACH


def test_a_robot_with_wheels_and_arm_has_both():
    charts, vitals, _ = dashboard(drives=True)
    assert [title.split()[0] for title in charts] == ["Speed", "Joints", "Localisation"]
    assert all(word in vitals for word in ("wheels", "health", "arm", "gripper"))
