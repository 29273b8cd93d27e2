"""Maps of markers: keys, boards, findings with positions, and a round trip."""

from math import pi
from pathlib import Path

import pytest

from stack.errors import InputError
from stack.mapping.marker_maps import marker_map_text, read_marker_map
from stack.types import Marker

FILE = Path("markers.yaml")


def read(text: str) -> tuple[Marker, ...]:
    return read_marker_map(FILE, text)


def test_single_markers_with_units_defaults_and_deviations():
    found = read(
        "markers:\n"
        "  - {id: 7, at: [3.2, 5.9], height: 42 cm, facing: -90 deg, position_deviation: 1 cm}\n"
        "  - {id: 7, at: [1, 2], facing: 0, dictionary: DICT_APRILTAG_36h11, size: 10 cm}\n"
    )
    assert found == (
        Marker(7, 0.2, (3.2, 5.9, 0.42), -pi / 2, "DICT_4X4_50", 0.01, 0.0),
        Marker(7, 0.1, (1.0, 2.0, 0.4), 0.0, "DICT_APRILTAG_36h11"),
    )


def test_a_board_is_a_grid_numbered_from_its_top_left_marker():
    """Facing y, the viewer looks against y: left is +x. Pitch 8 + 3 cm, centre at (8, 0, 1)."""
    board = read(
        "boards: [{id: 20, at: [8, 0], height: 1, facing: 90 deg, columns: 3, rows: 2, size: 8 cm,"
        " gap: 3 cm}]"
    )
    assert [one.number for one in board] == [20, 21, 22, 23, 24, 25]
    assert board[0].position == pytest.approx((8.11, 0.0, 1.055))
    assert board[5].position == pytest.approx((7.89, 0.0, 0.945))
    assert {one.heading for one in board} == {pi / 2}


def test_what_is_written_is_read_again():
    markers = (
        Marker(3, 0.15, (1.2346, -2.5, 0.4), 1.0, "DICT_APRILTAG_25h9", 0.0123, 0.01),
        Marker(4, 0.2, (0.0, 0.0, 0.5), -pi / 2),
    )
    found = read(marker_map_text(markers, "saved"))
    assert found[1] == markers[1]
    assert found[0].position == pytest.approx(markers[0].position, abs=1e-4)
    assert found[0].heading == pytest.approx(1.0, abs=1e-4)
    assert found[0].position_deviation == pytest.approx(0.0123)
    assert read(marker_map_text((), "none")) == ()


@pytest.mark.parametrize(
    "text, code, sentence",
    [
        ("markers: [{id: 99, at: [1, 2], facing: 0}]", "E406", "no marker 99; its ids are 0 to 49"),
        ("markers: [{id: 1, at: [1, 2], facing: 0}, {id: 1, at: [1, 2], facing: 0}]", "E406",
         "duplicate DICT_4X4_50 marker 1; the first is in line 1"),
        ("markers: [{id: 1, at: [1, 2], facing: 0, hight: 1}]", "E405", "did you mean 'height'"),
        ("markers: [{id: 1, at: [1], facing: 0}]", "E405", "expected [x, y]"),
        ("markers: [{at: [1, 2], facing: 0}]", "E405", "needs the key 'id'"),
        ("boards: [{id: 45, at: [1, 2], facing: 0, columns: 3, rows: 2, gap: 0}]", "E406",
         "no marker 50"),
        ("boards: [{id: 1, at: [1, 2], facing: 0, columns: 0, rows: 2, gap: 0}]", "E405",
         "columns"),
    ],
)  # fmt: skip
def test_findings_have_position_code_and_fix(text, code, sentence):
    with pytest.raises(InputError) as caught:
        read(text)
    assert [finding.code for finding in caught.value.findings] == [code]
    assert sentence in str(caught.value)
    assert str(caught.value).startswith("markers.yaml:1:")


def test_a_world_is_no_map_of_markers():
    with pytest.raises(InputError, match="this is a world file, not a map of markers"):
        read("world: x\nwalls: []\nmarkers: []\n")
