"""The controller `onnx_policy`: drives as its policy does in training; its file is checked."""

from __future__ import annotations

import re

import numpy as np
import pytest

import missions
from missions.execution.prepare import diagnose
from stack.control.policy.network import PolicyNetwork
from tests.missions.learning.policies import FOLLOWER, follower, save_affine
from treepilot.gym import MissionEnv


def findings(file):
    return [finding for finding in diagnose(file).findings if finding.severity == "error"]


def test_a_policy_drives_a_mission_to_its_goal(policy_mission, follower_file):
    file = policy_mission()
    assert not findings(file)
    report = missions.run(file, seed=2)
    assert report.status == "success"
    end = report.final_pose["truth"]
    assert np.hypot(end["x"] - 3.5, end["y"] - 2.3) < 0.3  # 25 cm, and the error of the pose


@pytest.mark.parametrize("more", ["", ", repeat: 3"], ids=["each step", "each third step"])
def test_in_a_mission_it_drives_what_it_does_in_training(policy_mission, follower_file, more):
    """Bit for bit: the same end at the same time, of the whole loop with noise and physics."""
    file = policy_mission(more=more)
    report = missions.run(file, seed=5)
    env = MissionEnv(file, observations=FOLLOWER, repeat=3 if more else 1)
    shapes = {field.name: field.low.shape for field in env.fields}
    policy = PolicyNetwork(follower_file, shapes, actions=2)
    observed, _ = env.reset(seed=5)
    is_over, facts = False, {}
    while not is_over:
        observed, _, is_over, is_late, facts = env.step(policy.decide(observed))
        assert not is_late
    assert facts["status"] == report.status == "success"
    run = env.run
    while not run.is_over:  # comes to a standstill, as at the end of a mission
        run.step()
    assert run.finish().final_pose == report.final_pose
    assert run.report.simulated_seconds == report.simulated_seconds
    env.close()


def test_one_input_of_another_name_is_flat(policy_mission, tmp_path):
    weights, offsets = follower()
    save_affine(
        tmp_path / "policy.onnx", weights, offsets, {"observation": (11,)},
        least=[0.0, -1.0], most=[0.5, 1.0],
    )  # fmt: skip
    assert missions.run(policy_mission()).status == "success"


@pytest.mark.parametrize(
    ("sizes", "actions", "expected"),
    [
        (None, 2, "cannot be read: No such file"),
        ({"path": (4, 2), "remaining": (1,)}, 2, r"an input path \(1 x 4 x 2\), but here"),
        ({"path": (5, 2)}, 2, "has no input 'remaining'"),
        ({"path": (5, 2), "speed": (1,)}, 2, r"an input speed \(1 x 1\), which is no observation"),
        ({"all": (12,)}, 2, r"an input all \(1 x 12\), but here it has 1 x 11"),
        ({"path": (5, 2), "remaining": (1,)}, 3, "an output of 1 x 3; a policy for this robot"),
    ],
    ids=["missing", "points", "input", "other input", "flat", "actions"],
)
def test_wrong_files_are_refused_before_anything_moves(
    policy_mission, tmp_path, sizes, actions, expected
):
    if sizes is not None:
        count = sum(int(np.prod(shape)) for shape in sizes.values())
        save_affine(tmp_path / "policy.onnx", np.zeros((actions, count)), [0] * actions, sizes)
    (found,) = findings(policy_mission())
    assert found.code == "E111"
    assert found.mark.line == 5
    assert found.sentence.startswith("onnx_policy: policy.onnx")
    assert re.search(expected, found.sentence), found.sentence


def test_a_damaged_file_is_refused(policy_mission, tmp_path):
    (tmp_path / "policy.onnx").write_bytes(b"no model")
    (found,) = findings(policy_mission())
    assert (found.code, found.mark.line) == ("E111", 5)


def test_a_robot_without_a_camera_has_no_pictures_for_a_policy(policy_mission, follower_file):
    file = policy_mission(names=("image",))
    file.write_text(file.read_text().replace("robot: scout", "robot: scout_depth"))
    assert any("no camera for the observation `image`" in one.sentence for one in findings(file))
