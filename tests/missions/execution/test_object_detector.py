"""The object detector in missions: checked before the run, searched for, costs on the map."""

import numpy as np
import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.prepare import RunOptions, diagnose
from missions.execution.running import run_mission
from robots.load import find_robot
from stack.components import available
from stack.perception.objects.model import ObjectModel
from tests.missions.execution.live_run import LiveRun
from tests.stack.perception.objects.tiny_models import save_constant, save_red_finder

WORLD = """world: den
format: 1
start: home
places: {home: [1, 2, -60 deg]}
walls:
  - {points: [[0, 0], [5, 0], [5, 4], [0, 4]], closed: true}
boxes:
  - {name: red box, at: [3.5, 2.3], size: [0.3, 0.3, 0.3], colour: [0.8, 0.1, 0.1], on_map: false}
"""
HEAD = """mission: seek
robot: scout
world: den.yaml
navigation:
  object_detector: {model: red.onnx}
"""
COSTS = """  costmap:
    layers:
      - static
      - obstacle
      - {use: semantic, things: [{label: red box, radius: 1 m, cost: 200, memory: 60 s}]}
"""
SEEK = """run:
  sequence:
    - find_object: {label: red box}
    - say: found
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "den.yaml").write_text(WORLD, "utf-8")
    save_red_finder(tmp_path / "red.onnx")
    return tmp_path


def checked(folder, head=HEAD, run=SEEK):
    path = folder / "seek.yaml"
    path.write_text(head + run, "utf-8")
    return [str(item).replace(f"{folder}/", "") for item in diagnose(path, RunOptions()).findings]


def test_a_mission_with_a_model_has_no_findings(folder):
    assert checked(folder, HEAD + COSTS) == []


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("gone.onnx", "gone.onnx cannot be read: No such file or directory"),
        ("page.onnx", "page.onnx is not an ONNX file: it has 15 bytes and begins with b'<!DOCTY"),
        ("other.onnx", "other.onnx has an output of 1 x 50 x 9; with 1 labels a YOLO head has"),
        ("nameless.onnx", "nameless.onnx does not state the names of its classes; list them"),
    ],
)
def test_a_wrong_file_is_a_finding_and_the_exit_code_is_2(folder, model, words):
    (folder / "page.onnx").write_bytes(b"<!DOCTYPE html>")
    save_constant(folder / "other.onnx", np.zeros((1, 50, 9)), metadata={"names": "['x']"})
    save_constant(folder / "nameless.onnx", np.zeros((1, 50, 6)))
    (finding,) = checked(folder, HEAD.replace("red.onnx", model), "run: {wait: 1 s}")
    assert finding.startswith(f"seek.yaml:5:28 error[E111] object_detector: {words}"), finding
    assert str(folder) not in finding
    done = CliRunner().invoke(app, ["check", str(folder / "seek.yaml")])
    assert done.exit_code == 2


def test_labels_are_compared_with_those_of_the_model(folder):
    (finding,) = checked(folder, run="run: {find_object: {label: red bax}}\n")
    assert finding == (
        "seek.yaml:6:28 error[E111] label: red.onnx has no label 'red bax'; did you mean 'red box'?"
    )
    run = "run: {approach_object: {label: red box}}\n"
    assert checked(folder, run=run) == []
    two = HEAD.replace("red.onnx}", "red.onnx, labels: [red box, cup], only: [cup]}")
    save_constant(folder / "red.onnx", np.zeros((1, 6, 9)))
    (finding,) = checked(folder, two, run)
    assert finding.endswith(
        "error[E111] label: object_detector.only leaves out 'red box'; add it to `only`"
    )


def test_a_robot_without_a_camera_is_a_warning(folder):
    path = folder / "seek.yaml"
    path.write_text(HEAD + "run: {wait: 1 s}\n", "utf-8")
    (warning,) = diagnose(path, RunOptions(camera="off")).findings
    assert (warning.code, warning.severity) == ("W142", "warning")
    assert "scout has no camera" in warning.sentence


def test_the_layer_is_listed():
    assert "semantic" in available("costmap_layer")


def test_it_finds_the_object_where_it_stands_and_runs_are_the_same(folder):
    path = folder / "seek.yaml"
    path.write_text(HEAD + SEEK, "utf-8")
    reports = [run_mission(path, RunOptions(seed=3, serve=False)) for _ in range(2)]
    assert [report.status for report in reports] == ["success", "success"]
    assert reports[0].log_sha256 == reports[1].log_sha256


@pytest.fixture
def live(folder):
    """Return a function that starts a run in the den."""
    runs = []

    def start(run, head=HEAD, **options):
        runs.append(LiveRun(folder, run, head=head, watch=False, **options))
        return runs[-1]

    yield start
    for run in runs:
        run.runtime.parts.perceiver.objects.close()
        run.close()


def test_the_costs_stand_where_the_object_was_seen_and_viewers_see_it(live):
    run = live(SEEK, HEAD + COSTS)
    run.until("say", within=400)
    (found,) = {item.position for item in run.snapshot.detections}
    # Its face is 2.35 m away at x = 3.35; the model reads pixels of the letterboxed picture.
    assert found == pytest.approx((3.36, 2.3), abs=0.12)
    grid = run.runtime.parts.perceiver.world_model.global_costmap.grid
    beside = grid.cells[grid.cell_at(3.4, 1.6)]
    assert 20 <= beside <= 120  # 0.7 m from the box: 200 * 0.3 = 60
    assert grid.cells[grid.cell_at(1.0, 1.0)] == 0


def test_a_walker_whom_a_depth_camera_sees_is_a_person_and_costs(live, folder):
    """Without a model. The camera looks up a little: scout's own does not see 1.2 m high."""
    scout = find_robot("scout", folder).parent
    text = (scout / "robot.yaml").read_text("utf-8")
    assert text.count("pitch: 25 deg") == 1
    (folder / "looker.yaml").write_text(text.replace("pitch: 25 deg", "pitch: -10 deg"), "utf-8")
    (folder / "scout.urdf").write_bytes((scout / "scout.urdf").read_bytes())
    ann = "people:\n  - {name: Ann, waypoints: [[3.2, 0.7], [3.2, 3.5]], speed: 0.6 m/s}\n"
    walls = WORLD.partition("boxes:")[0].replace("-60 deg", "0 deg")
    (folder / "den.yaml").write_text(walls + ann, "utf-8")
    run = live(
        "run: {wait: 9 s}\n",
        "mission: look\nrobot: looker.yaml\nworld: den.yaml\nnavigation:\n"
        "  depth: {obstacles: true}\n"
        "  costmap: {layers: [static, obstacle, depth, semantic]}\n",
    )
    run.steps(50)
    (walker,) = run.snapshot.tracks
    assert walker.label == "person"
    grid = run.runtime.parts.perceiver.world_model.global_costmap.grid
    behind = grid.cells[grid.cell_at(walker.position[0] + 0.6, walker.position[1])]
    # No sensor sees behind her, so nothing is inflated there. A track has an error.
    assert behind == pytest.approx(220 * (1 - 0.6 / 1.2), abs=15)


def test_a_model_that_fails_in_the_run_is_one_event_and_the_mission_goes_on(live, monkeypatch):
    run = live("run: {find_object: {label: red box}}\n")

    def broken(*_):
        raise RuntimeError("out of memory")

    monkeypatch.setattr(ObjectModel, "boxes", broken)
    run.steps(160)
    (text,) = run.texts("detector")
    assert text.startswith("the object detector is off: RuntimeError: out of memory")
    (ended,) = run.texts("mission_ended")
    assert "the object detector gave no result for 3 s" in ended


def test_the_threshold_is_tuned_while_the_mission_runs(live):
    run = live("run: {find_object: {label: red box}}\n")
    run.runtime.parts.live_parameters.change("object_detector.threshold", 0.7)
    assert run.runtime.parts.perceiver.objects.parameters.threshold == 0.7
    assert run.snapshot.parameters["object_detector.threshold"] == 0.7


def test_the_search_for_a_colour_shows_its_mask(live):
    run = live("run: {find_object: {colour: red}}\n", HEAD)
    masks = []
    for _ in range(120):
        run.steps()
        snapshot = run.snapshot
        if snapshot.mask is not None and (not masks or snapshot.mask is not masks[-1]):
            masks.append(snapshot.mask)
        if any(item.label == "red" for item in snapshot.detections):
            break
    assert masks[-1].pixels.shape == (240, 320) and masks[-1].pixels.any()
    stamps = [mask.stamp for mask in masks]
    assert stamps == sorted(set(stamps))
