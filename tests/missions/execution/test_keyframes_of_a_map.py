"""Keyframes in the folder of a mission's map: checked before the run."""

import shutil

from missions.execution.prepare import diagnose
from missions.execution.resources import MISSIONS

MISSION = """
mission: m
format: 1
robot: scout
world: six_rooms
start: study
map: flat
run: {check: 1 < 2}
"""


def test_a_damaged_keyframe_file_stops_the_mission(tmp_path):
    shutil.copytree(MISSIONS / "maps" / "flat", tmp_path / "flat")
    mission = tmp_path / "m.yaml"
    mission.write_text(MISSION)
    assert diagnose(mission).plan is not None
    (tmp_path / "flat" / "keyframes.npz").write_bytes(b"no archive")
    diagnosis = diagnose(mission)
    assert diagnosis.plan is None
    (finding,) = diagnosis.findings
    assert finding.code == "E407" and finding.mark.file.endswith("flat/keyframes.npz")
    assert "delete this file: the map works without it" in finding.hint
