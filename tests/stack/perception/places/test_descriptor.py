"""Global descriptors: a tiny network that knows a picture by the colours of its parts."""

from dataclasses import replace

import numpy as np
import pytest

from stack.errors import InputError, ParameterError
from stack.perception.places.descriptor import GlobalDescriptor, checked_digest
from stack.perception.places.keyframe_files import FILE, check_keyframes, read_keyframes
from stack.perception.places.memory import PlaceMemory
from stack.perception.places.parameters import PlaceParameters
from stack.perception.places.recogniser import PlaceRecogniser
from stack.types import Observation, Pose2D, PoseEstimate
from tests.stack.perception.objects.tiny_models import save_colour_descriptor, save_constant
from tests.stack.perception.places.test_places import (
    SETTLED,
    frames_at,
    keyframe,
    poster,
    quiet,
    seen,
    wall_scan,
)


@pytest.fixture
def file(tmp_path):
    return save_colour_descriptor(tmp_path / "colours.onnx")


def parameters(file, **more):
    return replace(SETTLED, descriptor=str(file), **more)


def test_the_vector_is_what_the_model_computes(file):
    """3 x 4 parts of 16 pixels: of a picture that is red on the left, half of the means are 1."""
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :32, 0] = 255
    found = GlobalDescriptor(parameters(file, descriptor_normalised=False)).describe(pixels)
    expected = np.zeros((3, 3, 4))
    expected[0, :, :2] = 1.0 / np.sqrt(6.0)  # 6 parts, and a vector of length 1
    assert found == pytest.approx(expected.ravel(), abs=1e-6)


def test_the_input_is_scaled_and_normalised_as_that_of_imagenet(file):
    """White is (1 - 0.485) / 0.229 = 2.249, 2.429 and 2.640 in the three channels."""
    model = GlobalDescriptor(parameters(file))
    assert model.length == 36
    found = model.describe(np.full((240, 320, 3), 255, np.uint8))
    means = np.array([2.2489, 2.4286, 2.6400])
    assert found.reshape(3, 12)[:, 0] == pytest.approx(
        means / np.sqrt(12.0 * (means**2).sum()), abs=1e-4
    )
    assert np.linalg.norm(found) == pytest.approx(1.0)


def test_the_same_picture_gives_the_same_bits(file):
    first, second = (GlobalDescriptor(parameters(file)) for _ in range(2))
    assert (first.describe(poster(1).pixels) == second.describe(poster(1).pixels)).all()
    assert first.digest == second.digest
    assert first.digest != GlobalDescriptor(parameters(file, descriptor_normalised=False)).digest


def test_a_wrong_file_is_refused_with_the_reason(tmp_path):
    page = tmp_path / "page.onnx"
    page.write_bytes(b"<!DOCTYPE html>")
    cases = {
        tmp_path / "gone.onnx": "cannot be read: No such file or directory",
        page: "is not an ONNX file: it has 15 bytes",
        save_colour_descriptor(tmp_path / "map.onnx", pooled=False):
            "has an output of 1 x 3 x 3 x 4; a descriptor has one of 1 x n",
        save_constant(tmp_path / "one.onnx", np.ones((1, 1))): "has an output of 1 x 1",
        save_constant(tmp_path / "two.onnx", np.ones((1, 8)), inputs=2):
            "expected a model with one input, a picture",
        save_constant(tmp_path / "nan.onnx", np.full((1, 8), np.nan)):
            "gives numbers that are not finite",
    }  # fmt: skip
    for wrong, words in cases.items():
        with pytest.raises(InputError) as caught:
            GlobalDescriptor(parameters(wrong))
        assert str(wrong) in str(caught.value) and words in str(caught.value)


def test_a_model_is_checked_in_another_process(file, tmp_path):
    assert checked_digest(PlaceParameters()) == ""
    assert checked_digest(parameters(file)) == GlobalDescriptor(parameters(file)).digest
    bad = tmp_path / "bad.onnx"
    bad.write_bytes(b"no model")
    with pytest.raises(InputError, match="is not an ONNX file"):
        checked_digest(parameters(bad))


def test_keyframes_are_retrieved_by_the_model(file):
    """With one candidate only the keyframe with the picture's own vector is compared."""
    model = GlobalDescriptor(parameters(file))
    poses = [Pose2D(2.0 * number, 0.0, 0.0) for number in range(4)]
    whole = [model.describe(poster(number).pixels).astype(np.float32) for number in range(4)]
    good = [replace(keyframe(n, pose), whole=whole[n]) for n, pose in enumerate(poses)]
    one = PlaceParameters(candidates=1)
    (best,) = PlaceRecogniser(good, one, descriptor=model).recognise(
        poster(2), wall_scan().points()
    )
    assert best.pose.distance_to(poses[2]) < 0.01
    assert best.similarity == pytest.approx(1.0, abs=1e-6)
    # Vectors of other pictures lead to another keyframe, whose features do not agree.
    wrong = [replace(item, whole=whole[(n + 1) % 4]) for n, item in enumerate(good)]
    found = PlaceRecogniser(wrong, one, descriptor=model)
    assert found.recognise(poster(2), wall_scan().points()) == ()
    assert PlaceRecogniser(wrong, one).recognise(poster(2), wall_scan().points())  # VLAD


def recorded(descriptor):
    memory = PlaceMemory("lidar", has_camera=True, parameters=SETTLED, descriptor=descriptor)
    for number in range(4):
        seen(memory, number, Pose2D(2.0 * number, 0.0, 0.0), 10.0)
    quiet(memory, 12.0)
    return memory


def saved(memory, folder):
    folder.mkdir()
    for name, content in memory.files().items():
        (folder / name).write_bytes(content)
    return folder


def test_saved_vectors_are_used_again(file, tmp_path):
    model = GlobalDescriptor(parameters(file))
    folder = saved(recorded(model), tmp_path / "map")
    found = read_keyframes(folder)
    assert found.model == model.digest and found.keyframes[3].whole.shape == (36,)
    fresh = PlaceMemory(
        "lidar", has_camera=True, parameters=PlaceParameters(candidates=1), descriptor=model
    )
    fresh.load(folder)
    frames = frames_at(Pose2D(0.0, 0.0), 29.0, 31.0)
    estimate = PoseEstimate(Pose2D(0.0, 0.0), np.eye(3), 0.0)
    fresh.update(Observation(30.0, {"lidar": wall_scan(30.0)}), frames, estimate, 0.0)
    (best, *_) = fresh.sightings(poster(3, 30.0), frames)
    assert best.pose.distance_to(Pose2D(6.0, 0.0)) < 0.01
    without = PlaceMemory("lidar", has_camera=True, parameters=PlaceParameters())
    without.load(folder)  # VLAD needs no model, and the vectors are kept
    assert without.files() == fresh.files()


def test_keyframes_of_another_model_or_without_one_are_refused(file, tmp_path):
    model = GlobalDescriptor(parameters(file))
    other = GlobalDescriptor(parameters(file, descriptor_normalised=False))
    cases = {
        "with another global descriptor": saved(recorded(other), tmp_path / "other"),
        "without a global descriptor": saved(recorded(None), tmp_path / "without"),
    }
    for words, folder in cases.items():
        for read in (
            lambda folder: check_keyframes(folder, model.digest),
            PlaceMemory("lidar", has_camera=True, parameters=SETTLED, descriptor=model).load,
        ):
            with pytest.raises(InputError) as caught:
                read(folder)
            (finding,) = caught.value.findings
            assert finding.mark.file == str(folder / FILE)
            assert finding.sentence == f"the keyframes were recorded {words}"


def test_the_model_cannot_be_changed_during_a_run(file):
    memory = PlaceMemory("lidar", has_camera=True, parameters=SETTLED)
    with pytest.raises(ParameterError, match="cannot be changed during a run"):
        memory.configure(parameters(file))
