"""ONNX files: those of a detector, and all others."""

import os
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from stack.errors import InputError, ParameterError
from stack.networks.onnx_file import read_header
from stack.networks.trial import tried
from stack.perception.objects.model import ObjectModel
from stack.perception.objects.parameters import ObjectDetectorParameters
from stack.perception.objects.trial import checked_labels
from tests.stack.perception.objects.tiny_models import save_constant, save_red_finder

OBJECTNESS = [[[32, 32, 10, 10, 0.9, 0.8, 0.1], [5, 5, 2, 2, 0.1, 0.5, 0.5]]]
NAMES = {"names": "{0: 'person', 1: 'chair'}"}


def parameters(file, **more):
    return ObjectDetectorParameters(model=str(file), **more)


@pytest.fixture
def red(tmp_path):
    return save_red_finder(tmp_path / "red.onnx")


def picture(*boxes):
    pixels = np.full((240, 320, 3), 110, np.uint8)
    for left, top, right, bottom in boxes:
        pixels[top:bottom, left:right] = (205, 25, 25)
    return pixels


def test_a_model_finds_what_it_was_made_for(red):
    model = ObjectModel(parameters(red))
    assert model.labels == ("red box",)
    (box,) = model.boxes(picture((200, 100, 240, 150)), 0.5, 0.45)
    # The input has 0.8 pixels per pixel of the picture.
    assert box.corners == pytest.approx((200, 100, 240, 150), abs=1.5)
    assert model.boxes(picture(), 0.5, 0.45) == []


def test_the_same_picture_gives_the_same_bits(red):
    pixels = np.random.default_rng(1).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    first, second = (ObjectModel(parameters(red)).boxes(pixels, 0.01, 0.45) for _ in range(2))
    assert first == second != []


def test_labels_come_from_the_file_unless_they_are_given(tmp_path):
    file = save_constant(tmp_path / "two.onnx", OBJECTNESS, metadata=NAMES)
    assert ObjectModel(parameters(file)).labels == ("person", "chair")
    assert ObjectModel(parameters(file, labels=["a", "b"])).labels == ("a", "b")
    listed = tmp_path / "names.txt"
    listed.write_text("cat\n\ndog \n", "utf-8")
    assert ObjectModel(parameters(file, label_file=str(listed))).labels == ("cat", "dog")
    written = save_constant(tmp_path / "list.onnx", OBJECTNESS, metadata={"names": "['x', 'y']"})
    assert ObjectModel(parameters(written)).labels == ("x", "y")


def test_an_open_input_size_is_that_of_the_parameters(tmp_path):
    file = save_constant(tmp_path / "open.onnx", OBJECTNESS, size=None, metadata=NAMES)
    (tensor,) = read_header(file).inputs
    assert tensor.shape == (1, 3, None, None)
    (box,) = ObjectModel(parameters(file, input_size=64)).boxes(
        np.zeros((64, 64, 3), np.uint8), 0.5, 0.45
    )
    assert box.corners == pytest.approx((27, 27, 37, 37))


@pytest.mark.parametrize(
    "content",
    [b"", b"<!DOCTYPE html><html>", b"\x08\x07", np.random.default_rng(0).bytes(4000)],
    ids=["empty", "page", "too short", "noise"],
)
def test_a_file_that_is_no_onnx_file_is_an_error(tmp_path, content):
    file = tmp_path / "model.onnx"
    file.write_bytes(content)
    with pytest.raises(InputError, match=f"is not an ONNX file: it has {len(content)} bytes"):
        ObjectModel(parameters(file))


def test_every_truncated_copy_is_an_error(red):
    whole = red.read_bytes()
    for length in range(0, len(whole), 37):
        red.write_bytes(whole[:length])
        with pytest.raises(InputError, match="is not an ONNX file"):
            ObjectModel(parameters(red))


def test_a_header_of_damaged_bytes_is_read_or_refused(red):
    whole, rng = red.read_bytes(), np.random.default_rng(7)
    for _ in range(300):
        damaged = bytearray(whole)
        damaged[rng.integers(0, len(damaged))] ^= 1 << int(rng.integers(0, 8))
        red.write_bytes(damaged)
        with suppress(InputError):
            read_header(red)


def test_a_file_that_crashes_opencv_is_an_error_of_the_check(red):
    """A stand-in for a damaged file: which bytes crash differs from one OpenCV to the next."""
    with pytest.raises(InputError, match=r"crashes OpenCV \(exit code -11\): the file is damaged"):
        tried("tests.stack.perception.objects.crash", {}, [str(red)])


def test_a_missing_file_and_a_folder_are_errors(tmp_path):
    for file in (tmp_path / "nowhere.onnx", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            ObjectModel(parameters(file))


def test_an_output_that_is_no_detection_names_both_shapes(tmp_path):
    file = save_constant(tmp_path / "five.onnx", np.zeros((1, 50, 9)), metadata=NAMES)
    with pytest.raises(InputError, match=r"output of 1 x 50 x 9; with 2 labels .* 1 x n x 7 or"):
        ObjectModel(parameters(file))
    classifier = save_constant(tmp_path / "classes.onnx", np.zeros((1, 1000)), metadata=NAMES)
    with pytest.raises(InputError, match="output of 1 x 1000"):
        ObjectModel(parameters(classifier))


@pytest.mark.parametrize("names", ["", "{0: 'a', 2: 'b'}", "[", "{0: 1}", "[" * 300, "exit()"])
def test_missing_labels_say_how_to_give_them(tmp_path, names):
    file = save_constant(tmp_path / "none.onnx", OBJECTNESS, metadata={"names": names})
    with pytest.raises(InputError, match=r"not state the names .* `labels: \[person, chair\]`"):
        ObjectModel(parameters(file))


def test_two_inputs_are_an_error(tmp_path):
    file = save_constant(tmp_path / "two.onnx", OBJECTNESS, metadata=NAMES, inputs=2)
    with pytest.raises(InputError, match="expected a model with one input"):
        ObjectModel(parameters(file))


def test_a_label_file_without_labels_is_an_error(tmp_path):
    file = save_constant(tmp_path / "two.onnx", OBJECTNESS)
    names = tmp_path / "names.txt"
    names.write_bytes(b"\n\n")
    with pytest.raises(InputError, match="has no lines"):
        ObjectModel(parameters(file, label_file=str(names)))
    names.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        ObjectModel(parameters(file, label_file=str(names)))
    with pytest.raises(InputError, match=r"label_file: .* cannot be read"):
        ObjectModel(parameters(file, label_file=str(tmp_path / "nowhere.txt")))


def test_a_checked_file_is_read_again_when_it_changes(tmp_path):
    file = save_constant(tmp_path / "two.onnx", OBJECTNESS, metadata=NAMES)
    assert checked_labels(parameters(file)) == ("person", "chair")
    with pytest.raises(InputError, match=r"only: .* has no label 'cahir'; did you mean 'chair'"):
        checked_labels(parameters(file, only=["cahir"]))
    file.write_bytes(b"gone")
    os.utime(file, ns=(1, 1))
    with pytest.raises(InputError, match="not an ONNX file"):
        checked_labels(parameters(file))


def test_parameters_that_contradict_each_other():
    with pytest.raises(ParameterError, match="expected a list of labels"):
        ObjectDetectorParameters(labels="person")
    with pytest.raises(ParameterError, match="both `labels` and `label_file`"):
        ObjectDetectorParameters(labels=["a"], label_file="b")


def test_files_are_relative_to_the_mission(tmp_path):
    given = ObjectDetectorParameters(model="a.onnx", label_file="b.txt")
    located = given.located(tmp_path)
    assert located == replace(
        given, model=str(tmp_path / "a.onnx"), label_file=str(tmp_path / "b.txt")
    )
    assert ObjectDetectorParameters().located(tmp_path) == ObjectDetectorParameters()
