"""A mission that a policy drives, and the policy."""

from __future__ import annotations

import pytest

from tests.missions.learning.policies import FOLLOWER, MISSION, follower, save_affine


@pytest.fixture
def policy_mission(tmp_path):
    """A function that writes the mission and returns its file."""

    def write(goal="[3.5, 2.3, 0]", names=FOLLOWER, more=""):
        file = tmp_path / "policy.yaml"
        file.write_text(MISSION.format(goal=goal, names=", ".join(names), more=more))
        return file

    return write


@pytest.fixture
def follower_file(tmp_path):
    """The policy `follower` beside the mission."""
    return save_affine(
        tmp_path / "policy.onnx", *follower(), {"path": (5, 2), "remaining": (1,)},
        least=[0.0, -1.0], most=[0.5, 1.0],
    )  # fmt: skip
