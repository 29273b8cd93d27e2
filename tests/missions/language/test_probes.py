"""What people write wrong is found where it stands; what is unusual and right has no finding."""

import pytest

from missions.inspection.check import check_files
from missions.testing.session import Options, run_files
from tests.missions.language.probe_table import probes

PROBES = probes()
WRONG = [probe for probe in PROBES if probe.is_wrong]
RIGHT = [probe for probe in PROBES if not probe.is_wrong]


def _findings(probe, folder):
    file = folder / "mission.yaml"
    file.write_text(probe.mission())
    return check_files([str(file)])


@pytest.mark.parametrize("probe", WRONG, ids=lambda probe: f"{probe.file}: {probe.title}")
def test_a_wrong_mission_is_caught_at_its_line(probe, tmp_path):
    found = _findings(probe, tmp_path)
    places = {(item.finding.code, item.finding.mark.line) for item in found}
    assert probe.expected
    assert probe.expected == places, [item.text for item in found]
    if probe.says:
        assert any(probe.says in item.text for item in found), [item.text for item in found]


@pytest.mark.parametrize("probe", RIGHT, ids=lambda probe: probe.title)
def test_an_unusual_mission_that_is_right_has_no_finding(probe, tmp_path):
    assert [item.text for item in _findings(probe, tmp_path)] == []


@pytest.mark.parametrize(
    "probe", [probe for probe in RIGHT if probe.file == "predicted"], ids=lambda probe: probe.title
)
def test_an_unusual_mission_runs_as_predicted(probe, tmp_path):
    file = tmp_path / "mission.yaml"
    file.write_text(probe.mission())
    session = run_files([str(file)], Options())
    assert session.exit_code == 0, session.text


def test_the_table_is_as_large_as_promised():
    assert len(WRONG) >= 150
    assert len(RIGHT) >= 40
    assert len({probe.title for probe in PROBES}) == len(PROBES)
