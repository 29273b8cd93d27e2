"""The global descriptor in missions: checked before the run."""

from missions.execution.prepare import RunOptions, diagnose, prepare
from tests.stack.perception.objects.tiny_models import save_colour_descriptor, save_constant

MISSION = """mission: look
robot: scout
world: office
navigation:
  place_recognition: {record: true, descriptor: MODEL}
run: {wait: 1 s}
"""


def written(folder, model):
    path = folder / "look.yaml"
    path.write_text(MISSION.replace("MODEL", model), "utf-8")
    return path


def test_the_file_is_found_beside_the_mission(tmp_path):
    file = save_colour_descriptor(tmp_path / "colours.onnx")
    path = written(tmp_path, "colours.onnx")
    assert diagnose(path, RunOptions()).findings == ()
    plan = prepare(path, RunOptions())
    assert plan.choices["place_recognition"].parameters.descriptor == str(file)


def test_a_model_without_a_vector_is_a_finding(tmp_path):
    save_constant(tmp_path / "boxes.onnx", [[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]])
    path = written(tmp_path, "boxes.onnx")
    (finding,) = diagnose(path, RunOptions()).findings
    assert str(finding).replace(f"{tmp_path}/", "") == (
        "look.yaml:5:49 error[E111] place_recognition: boxes.onnx has an output of 1 x 2 x 3; a "
        "descriptor has one of 1 x n, the vector of the picture; export the model with its pooling"
    )
