"""Letterboxing and YOLO heads: boxes in, boxes out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.perception.objects.heads import boxes_of, decoded, layout_of, letterboxed

SIZE = (96, 128)


def head(layout, rows, classes, filler=50):
    """Return a head's output with objects (cx, cy, w, h, score, class) among empty candidates."""
    table = np.zeros((filler + len(rows), 4 + classes), np.float32)
    table[:filler, :4] = 10.0
    for number, (*place, score, label) in enumerate(rows, start=filler):
        table[number, :4], table[number, 4 + label] = place, score
    if layout == "plain":
        return table[None]
    if layout == "transposed":
        return np.ascontiguousarray(table.T[None])
    if layout == "objectness":
        sure = np.where(table[:, 4:].max(axis=1, keepdims=True) > 0.0, 0.9, 0.0)
        return np.hstack([table[:, :4], sure, table[:, 4:]]).astype(np.float32)[None]
    half = table[:, 2:4] / 2
    best = table[:, 4:]
    return np.hstack(
        [table[:, :2] - half, table[:, :2] + half, best.max(axis=1, keepdims=True),
         best.argmax(axis=1)[:, None]]
    ).astype(np.float32)[None]  # fmt: skip


LAYOUTS = ("objectness", "transposed", "plain", "final")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_boxes(layout):
    output = head(layout, [(40, 50, 20, 10, 0.8, 2), (90, 30, 8, 16, 0.6, 0)], classes=3)
    assert layout_of(output.shape, 3) == layout
    _, place = letterboxed(np.zeros((240, 320, 3), np.uint8), SIZE)
    first, second = boxes_of(output, layout, place, (240, 320), 0.5, 0.45)
    # 320 x 240 fits 128 x 96 at a scale of 0.4 without a border.
    assert first.corners == pytest.approx((75, 112.5, 125, 137.5), abs=1e-3)
    assert (first.label, second.label) == (2, 0)
    certain = 0.9 if layout == "objectness" else 1.0
    assert (first.score, second.score) == pytest.approx((0.8 * certain, 0.6 * certain))


def test_a_square_input_has_borders_above_and_below():
    white = np.full((240, 320, 3), 255, np.uint8)
    blob, place = letterboxed(white, (64, 64))
    # 320 x 240 becomes 64 x 48, with (64 - 48) / 2 = 8 rows above and below.
    assert (place.scale, place.left, place.top) == (0.2, 0, 8)
    assert blob.shape == (1, 3, 64, 64) and blob.dtype == np.float32
    assert np.all(blob[:, :, 8:56] == 1.0)
    assert np.allclose(blob[:, :, :8], 114 / 255) and np.allclose(blob[:, :, 56:], 114 / 255)


def test_colours_stay_in_the_order_red_green_blue():
    picture = np.zeros((10, 10, 3), np.uint8)
    picture[..., 0] = 255
    blob, _ = letterboxed(picture, (10, 10))
    assert (blob[0, 0].min(), blob[0, 1].max(), blob[0, 2].max()) == (1.0, 0.0, 0.0)


@given(
    rows=st.integers(20, 400), columns=st.integers(20, 400),
    box=st.tuples(*[st.floats(0.0, 1.0)] * 4),
)  # fmt: skip
@settings(deadline=None, max_examples=50)
def test_a_box_returns_to_its_place_from_any_proportions(rows, columns, box):
    x, y = sorted(box[:2]), sorted(box[2:])
    corners = np.array([x[0] * columns, y[0] * rows, x[1] * columns, y[1] * rows])
    if (corners[2:] - corners[:2] < 3.0).any():
        return
    _, place = letterboxed(np.zeros((rows, columns, 3), np.uint8), SIZE)
    inside = corners * place.scale + [place.left, place.top] * 2
    middle, sides = (inside[:2] + inside[2:]) / 2, inside[2:] - inside[:2]
    output = head("transposed", [(*middle, *sides, 0.9, 0)], classes=1)
    (found,) = boxes_of(output, "transposed", place, (rows, columns), 0.5, 0.45)
    assert found.corners == pytest.approx(corners, abs=0.01 / place.scale)


def picked(rows, overlap=0.45, threshold=0.5):
    output = head("transposed", rows, classes=2)
    _, place = letterboxed(np.zeros((*SIZE, 3), np.uint8), SIZE)
    return boxes_of(output, "transposed", place, SIZE, threshold, overlap)


def test_boxes_that_overlap_are_one_object_unless_their_labels_differ():
    # 20 x 20 boxes 5 apart: 15 * 20 / (2 * 400 - 300) = 0.6.
    one, other = (40, 40, 20, 20, 0.9, 0), (45, 40, 20, 20, 0.8, 0)
    assert [box.score for box in picked([other, one])] == pytest.approx([0.9])
    assert len(picked([one, other], overlap=0.65)) == 2
    assert len(picked([one, (45, 40, 20, 20, 0.8, 1)])) == 2


def test_weak_small_and_outside_boxes_are_left_out():
    assert picked([(40, 40, 20, 20, 0.45, 0)]) == []
    assert len(picked([(40, 40, 20, 20, 0.45, 0)], threshold=0.4)) == 1
    assert picked([(40, 40, 1, 20, 0.9, 0)]) == []
    assert picked([(-40, 40, 20, 20, 0.9, 0)]) == []
    (cut,) = picked([(0, 40, 20, 20, 0.9, 0)])
    assert cut.corners == pytest.approx((0, 30, 10, 50))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_values_that_are_not_finite_are_no_boxes(layout):
    output = head(layout, [(40, 40, 20, 20, 0.9, 0)], classes=3, filler=2)
    output[:, :, :] = np.where(np.random.default_rng(3).random(output.shape) < 0.9, np.nan, output)
    corners, scores, labels = decoded(output, layout, 0.5)
    assert np.isfinite(corners).all() and len(corners) == len(scores) == len(labels)


@pytest.mark.parametrize("shape", [(1, 7), (1, 3, 64, 64), (2, 50, 8), (1, 50, 9), (1, 9, 50)])
def test_other_shapes_have_no_layout(shape):
    assert layout_of(shape, 3) == ""
