"""The sample package, put on sys.path with the metadata that `pip install` would write."""

import shutil
import tomllib
from pathlib import Path

import pytest

from behaviours.catalogue import GROUP, find_behaviours
from behaviours.kind import build
from behaviours.testing import ScriptedRobot, tick

SAMPLE = Path(__file__).parent / "sample_package"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A site-packages folder with the sample installed in it."""
    project = tomllib.loads((SAMPLE / "pyproject.toml").read_text())["project"]
    shutil.copytree(SAMPLE / "treepilot_sample_signals", tmp_path / "treepilot_sample_signals")
    metadata = tmp_path / "treepilot_sample_signals-0.1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    entries = project["entry-points"][GROUP]
    lines = [f"{name} = {value}" for name, value in entries.items()]
    (metadata / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines, ""]))
    monkeypatch.syspath_prepend(tmp_path)
    return metadata


def test_an_installed_package_is_found(site):
    catalogue = find_behaviours()
    assert catalogue.problems == ()
    honk = build(catalogue.get("honk_horn"), "honk", {"times": 2})
    robot = ScriptedRobot()
    tick(honk, robot)
    assert robot.said == ["honk honk"]
    assert catalogue.get("flash").summary == "Flash the lamp."


def test_a_broken_entry_point_is_reported_with_its_package(site):
    with (site / "entry_points.txt").open("a") as file:
        file.write("lost = treepilot_sample_signals:Missing\ngone = no_such_module\n")
    catalogue = find_behaviours()
    assert catalogue.get("honk_horn") is not None
    gone, lost = catalogue.problems
    assert gone.file == "entry point gone = no_such_module of treepilot-sample-signals"
    assert gone.sentence == "cannot import: No module named 'no_such_module'"
    assert lost.file.startswith("entry point lost = treepilot_sample_signals:Missing")
    assert "has no attribute 'Missing'" in lost.sentence
    assert (gone.plugin, lost.plugin) == (-1, -1)  # nobody asked for them


def test_a_package_that_is_removed_is_not_found_again(site):
    assert find_behaviours().get("honk_horn") is not None
    shutil.rmtree(site)
    assert find_behaviours().get("honk_horn") is None
