import pytest

from tests.missions.execution.killed_runs import kill_one


@pytest.mark.parametrize("after", [0.0, 1.5])
def test_a_killed_run_leaves_what_it_has_written(tmp_path, after):
    found = kill_one(tmp_path / "run", after)
    assert found["was running"] and found["events"] > 0
    assert all(found[name] for name in ("numbered", "mission whole", "no report", "readable"))
    assert found["recorded"] > 0 or after == 0.0
