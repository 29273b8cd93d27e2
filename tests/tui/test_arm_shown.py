"""The arm in the vitals pane: joints between their limits, tool and gripper."""

from dataclasses import replace

import numpy as np
import pytest
from rich.text import Text

from stack.types import ArmView
from tui.panes.vitals_pane import arm_lines

TOOL = np.eye(4)
TOOL[:3, 3] = 0.307, -0.1, 1.083
ARM = ArmView(
    ("a", "b", "c"), np.array([-1.0, 0.5, 2.0]), np.array([-1.0, -1.0, -1.0]),
    np.array([2.0, 2.0, 2.0]), False, TOOL, "", 0.04, 0.08, 12.4,
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
