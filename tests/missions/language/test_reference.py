"""The documentation of the language is current, and its example works."""

from pathlib import Path

from tests.missions.language.reference import PAGE, fill
from tests.missions.mission_fakes import Ran, read_text

GUIDE = Path(__file__).parents[3] / "docs" / "language.md"


def test_the_tables_are_current():
    text = PAGE.read_text(encoding="utf-8")
    assert text == fill(text), "run python -m tests.missions.language.reference"


def test_the_example_runs(tmp_path):
    example = GUIDE.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0]
    mission = read_text(tmp_path, example)
    assert mission.warnings == ()
    it = Ran(mission)
    it.ticks(100)
    assert it.tree.status.name == "SUCCESS"
    assert it.tree.blackboard() == {"photo": "images/photo_0006.00s.png", "visited": "2"}
