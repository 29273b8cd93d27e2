"""Small missions for sweeps."""

from __future__ import annotations

import pytest

TURN = """\
mission: turn
robot: scout
world: small_room
arguments:
  angle: {type: angle, default: 40 deg}
  times: {type: int, default: 1, range: [1, 3]}
  goal:  {type: Pose, default: $home}
run:
  sequence:
    - navigate_to_pose: {goal: $goal}
      timeout: 4 s
    - spin: {angle: $angle}
      repeat: $times
"""


@pytest.fixture
def turn(tmp_path):
    """A mission of one to two simulated seconds; a far goal times out."""
    file = tmp_path / "turn.yaml"
    file.write_text(TURN)
    return file
