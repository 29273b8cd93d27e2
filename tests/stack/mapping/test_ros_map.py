"""Maps in ROS' format: map_server's rules, worked out by hand, and the round trip."""

from math import pi

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from stack.documents import Findings
from stack.errors import InputError
from stack.mapping.pictures import Picture
from stack.mapping.ros_map import Shading, occupancies, read_ros_map, turned
from stack.sim.import_world import read_any_world
from stack.types import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Pose2D
from tests.stack.mapping.written_maps import write_ros_map

YAML = """\
image: map.pgm
mode: trinary
resolution: 0.05
origin: [-1.0, 2.5, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "map.yaml").write_text(YAML)
    (tmp_path / "map.pgm").write_bytes(
        b"P5\n# by hand\n3 2\n255\n" + bytes([0, 254, 205, 90, 89, 206])
    )
    return tmp_path


def rewrite(folder, old, new):
    assert old in YAML
    (folder / "map.yaml").write_text(YAML.replace(old, new))
    return folder / "map.yaml"


def test_the_bottom_row_of_the_image_is_the_first_row_of_the_grid(folder):
    grid = read_ros_map(folder / "map.yaml")
    # occ = 1 - shade/255: 90 -> 0.647 and 206 -> 0.192 lie either side of the thresholds, as do
    # 89 -> 0.651 and map_saver's 205 -> 0.19608.
    assert grid.cells.tolist() == [[UNKNOWN, OCCUPIED, FREE], [OCCUPIED, FREE, UNKNOWN]]
    assert grid.resolution == 0.05 and grid.origin == (-1.0, 2.5)
    assert grid.centre_of(0, 0) == pytest.approx((-0.975, 2.525))


def test_negate_makes_white_occupied(folder):
    grid = read_ros_map(rewrite(folder, "negate: 0", "negate: 1"))
    # occ = shade/255: 0, 0.996, 0.804 over 0.353, 0.349, 0.808.
    assert grid.cells.tolist() == [
        [UNKNOWN, UNKNOWN, OCCUPIED],
        [FREE, OCCUPIED, OCCUPIED],
    ]


def test_scale_interpolates_between_the_thresholds(folder):
    grid = read_ros_map(rewrite(folder, "mode: trinary", "mode: scale"))
    # 205: (0.19608 - 0.196) / 0.454 = 0.02 % -> 0; 90: (0.64706 - 0.196) / 0.454 = 99.4 % -> 99.
    assert grid.cells.tolist() == [[99, 100, 0], [100, 0, 0]]
    # 150: (0.41176 - 0.196) / 0.454 = 47.52 %, rounded to the nearest.
    grey = Picture(np.full((1, 1, 1), 150 / 255))
    assert occupancies(grey, Shading("scale", False, 0.65, 0.196)).tolist() == [[48]]


def test_raw_uses_bytes_up_to_100_as_occupancy(folder):
    grid = read_ros_map(rewrite(folder, "mode: trinary", "mode: raw"))
    assert grid.cells.tolist() == [[90, 89, UNKNOWN], [0, UNKNOWN, UNKNOWN]]


def test_alpha_is_a_fourth_colour_in_trinary_and_unknown_in_scale():
    white_clear = Picture(np.ones((1, 1, 3)), np.zeros((1, 1)))
    black_clear = Picture(np.zeros((1, 1, 3)), np.zeros((1, 1)))
    trinary, scale = Shading("trinary", False, 0.65, 0.2), Shading("scale", False, 0.65, 0.2)
    # (1 + 1 + 1 + 0) / 4 = 0.75 bright, so 0.25 occupied: between the thresholds.
    assert occupancies(white_clear, trinary).tolist() == [[UNKNOWN]]
    assert occupancies(black_clear, trinary).tolist() == [[OCCUPIED]]
    assert occupancies(white_clear, scale).tolist() == [[UNKNOWN]]
    assert occupancies(black_clear, scale).tolist() == [[UNKNOWN]]


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_png_images_can_be_grey_coloured_or_transparent(folder, channels):
    pixels = np.array([[0, 255]], np.uint8)
    image = pixels if channels == 1 else np.repeat(pixels[:, :, None], channels, axis=2)
    if channels == 4:
        image[:, :, 3] = 255
    cv2.imwrite(str(folder / "map.png"), image)
    grid = read_ros_map(rewrite(folder, "map.pgm", "map.png"))
    # A black opaque pixel has (0 + 0 + 0 + 1) / 4 = 0.25 brightness: 0.75 > 0.65 is occupied.
    assert grid.cells.tolist() == [[OCCUPIED, FREE]]


def test_plain_and_16_bit_pgm_images(folder):
    (folder / "map.pgm").write_bytes(b"P2 # plain\n2 1\n15\n0 15\n")
    assert read_ros_map(folder / "map.yaml").cells.tolist() == [[OCCUPIED, FREE]]
    (folder / "map.pgm").write_bytes(b"P5 2 1 65535\n" + b"\x00\x10\xff\xf0")
    assert read_ros_map(folder / "map.yaml").cells.tolist() == [[OCCUPIED, FREE]]


WRONG = [
    ("image: map.pgm\n", "", "1:1 E401 a map file needs the key 'image'"),
    ("map.pgm", "mop.pgm", "1:8 E402 image: there is no file 'mop.pgm' in the folder of this file"),
    ("map.pgm", "map.yaml", "1:8 E402 image: 'map.yaml' is not a PGM, PPM, PNG, BMP or JPEG i"),
    ("map.pgm", "cut.pgm", "1:8 E402 image: 'cut.pgm' is a damaged PGM: it has 3 of 6 pixels"),
    ("map.pgm", "cut.png", "1:8 E402 image: 'cut.png' is a damaged PNG: its end is missing"),
    ("map.pgm", "huge.pgm", "1:8 E402 image: 'huge.pgm' has 9000 x 9000 pixels; a map image has 1"),
    ("map.pgm", "huge.png", "1:8 E402 image: 'huge.png' has 100000 x 100000 pixels; a map image"),
    ("map.pgm", "digits.pgm", "1:8 E402 image: 'digits.pgm' is a damaged PGM: not all of its val"),
    ("map.pgm", "/dev/zero", "1:8 E402 image: '/dev/zero' cannot be read: not a regular file but"),
    ("map.pgm", "large.pgm", "1:8 E402 image: 'large.pgm' has 500000000 bytes or more; at most 26"),
    ("map.pgm", ".", "1:8 E402 image: '.' cannot be read: Is a directory"),
    ("0.05", "-1", "3:13 E401 resolution: -1 m must be at least 0.01 m"),
    ("0.05", "0.001", "3:13 E401 resolution: 0.001 m must be at least 0.01 m"),
    ("2.5, 0.0]", "2.5, 1e9]", "4:21 E401 yaw: 1e+09 rad must be at most 1000 rad"),
    ("2.5, 0.0]", "2.5]", "4:9 E401 origin: expected [x, y, yaw], got a list of 2"),
    ("negate: 0", "negate: 2", "5:9 E401 negate: expected 0 or 1, got 2"),
    ("trinary", "trinery", "2:7 E401 mode: 'trinery' is not one of trinary, scale, raw; did you"),
    ("0.196", "0.7", "7:14 E401 free_thresh: 0.7 must be below occupied_thresh 0.65"),
    ("map.pgm", "cut.bmp", "1:8 E402 image: 'cut.bmp' is a damaged BMP"),
    ("map.pgm", "huge.bmp", "1:8 E402 image: 'huge.bmp' has 100000 x 9 pixels; a map image has 1"),
    ("map.pgm", "cut.jpg", "1:8 E402 image: 'cut.jpg' is a damaged JPEG: its end is missing"),
    ("map.pgm", "huge.jpg", "1:8 E402 image: 'huge.jpg' has 9 x 65000 pixels; a map image has 1"),
    ("map.pgm", "cut.ppm", "1:8 E402 image: 'cut.ppm' is a damaged PPM: it has 1 of 2 pixels"),
]


@pytest.mark.parametrize(("old", "new", "expected"), WRONG)
def test_a_mistake_is_reported_with_its_position(folder, old, new, expected):
    (folder / "cut.pgm").write_bytes(b"P5 3 2 255\nabc")
    (folder / "huge.pgm").write_bytes(b"P5 9000 9000 255\nabc")
    encoded = cv2.imencode(".png", np.zeros((9, 9), np.uint8))[1].tobytes()
    (folder / "cut.png").write_bytes(encoded[:-20])
    side = (100_000).to_bytes(4, "big")
    (folder / "huge.png").write_bytes(encoded[:16] + side + side + encoded[24:])
    (folder / "digits.pgm").write_bytes(b"P2 1 1 255\n" + b"9" * 5000)
    bmp = cv2.imencode(".bmp", np.zeros((9, 9), np.uint8))[1].tobytes()
    (folder / "cut.bmp").write_bytes(bmp[:40])
    (folder / "huge.bmp").write_bytes(bmp[:18] + side[::-1] + bmp[22:])
    jpg = cv2.imencode(".jpg", np.zeros((9, 9), np.uint8))[1].tobytes()
    (folder / "cut.jpg").write_bytes(jpg[:-40])
    frame = jpg.index(b"\xff\xc0") + 5
    (folder / "huge.jpg").write_bytes(jpg[:frame] + (65000).to_bytes(2, "big") + jpg[frame + 2 :])
    (folder / "cut.ppm").write_bytes(b"P6 2 1 255\nabc")
    with (folder / "large.pgm").open("wb") as large:
        large.truncate(500_000_000)
    with pytest.raises(InputError) as caught:
        read_ros_map(rewrite(folder, old, new))
    found = [
        f"{item.mark.line}:{item.mark.column} {item.code} {item.sentence}; {item.hint}"
        for item in caught.value.findings
    ]
    assert [line[: len(expected)] for line in found] == [expected]


def test_an_unknown_key_is_a_warning(folder):
    """Programs add keys of their own; nav2_map_server ignores them."""
    findings = Findings()
    grid = read_ros_map(rewrite(folder, "negate: 0", "negate: 0\nlevel: 3"), findings)
    assert grid.cells.shape == (2, 3)
    assert [
        f"{item.mark.line} {item.severity} {item.code} {item.sentence}" for item in findings.items
    ] == ["6 warning W401 a map file has no key 'level': it is ignored"]


@pytest.mark.parametrize("suffix", ["bmp", "jpg", "ppm", "png", "pgm"])
@pytest.mark.parametrize("channels", [1, 3])
def test_images_of_other_kinds_show_the_same_map(folder, suffix, channels):
    """Squares of 16 pixels, which JPEG keeps: black, white, and a grey of 205."""
    if (suffix, channels) in (("ppm", 1), ("pgm", 3)):
        pytest.skip("a PPM has colours, a PGM has none")
    pixels = np.kron(np.array([[0, 254, 205]], np.uint8), np.ones((16, 16), np.uint8))
    image = pixels if channels == 1 else np.dstack([pixels] * 3)
    assert cv2.imwrite(str(folder / f"map.{suffix}"), image)
    grid = read_ros_map(rewrite(folder, "map.pgm", f"map.{suffix}"))
    assert grid.cells[8, [8, 24, 40]].tolist() == [OCCUPIED, FREE, UNKNOWN]
    assert (grid.occupied.sum(), grid.free.sum()) == (256, 256)


def test_a_plain_colour_image_of_text(folder):
    (folder / "map.pgm").write_bytes(b"P3 # plain\n2 1\n255\n0 0 0 255 255 255\n")
    assert read_ros_map(folder / "map.yaml").cells.tolist() == [[OCCUPIED, FREE]]


@pytest.mark.parametrize("name", ["map.yaml", "other.yaml", "map.yml"])
def test_an_image_is_read_with_the_yaml_file_that_names_it(folder, name):
    (folder / "map.yaml").rename(folder / name)
    (folder / "a.yaml").write_text("image: [")  # not read: it names nothing
    (folder / "b.yaml").write_text(YAML.replace("map.pgm", "b.pgm"))
    assert read_ros_map(folder / "map.pgm").origin == (-1.0, 2.5)
    assert read_any_world(folder / "map.pgm").boxes


def test_an_image_without_a_yaml_file_is_an_error(folder):
    (folder / "map.yaml").unlink()
    with pytest.raises(InputError, match=r"map.pgm:1:1 error\[E401\] an image has no scale"):
        read_ros_map(folder / "map.pgm")
    with pytest.raises(InputError, match="E001"):
        read_ros_map(folder / "mop.pgm")


@given(arrays(np.int8, st.tuples(st.integers(1, 9), st.integers(1, 9)),
              elements=st.sampled_from([0, 100, -1])), st.integers(-5, 5))  # fmt: skip
def test_a_yaw_of_quarter_turns_moves_each_cell_exactly(cells, quarters):
    grid = OccupancyGrid(cells, 0.05, (-1.0, 2.5))
    frame = Pose2D(-1.0, 2.5, quarters * pi / 2)
    found = turned(grid, quarters * pi / 2)
    for row, column in np.ndindex(*cells.shape):
        x, y = frame.transform(np.array([[(column + 0.5) * 0.05, (row + 0.5) * 0.05]]))[0]
        assert found.cells[found.cell_at(x, y)] == cells[row, column]
    assert sorted(found.cells.shape) == sorted(cells.shape)


@settings(deadline=None, max_examples=60)
@given(yaw=st.floats(-7, 7), x=st.floats(-50, 50), y=st.floats(-50, 50))
def test_a_yaw_turns_the_map_about_its_origin(yaw, x, y):
    """Every cell of the turned grid shows what stands at its middle, and nothing is cut off."""
    cells = np.zeros((20, 30), np.int8)
    cells[5:8, 10:25] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, (x, y))
    found, frame = turned(grid, yaw), Pose2D(x, y, yaw)
    rows, columns = np.indices(found.cells.shape)
    middles = np.array(
        [found.centre_of(r, c) for r, c in zip(rows.flat, columns.flat, strict=True)]
    )
    local = frame.inverse().transform(middles)
    known = found.cells.ravel() != UNKNOWN
    wall = (np.abs(local - (1.75, 0.65)) < (0.75 - 1e-6, 0.15 - 1e-6)).all(axis=1)
    inside = (np.abs(local - (1.5, 1.0)) < (1.5 - 1e-6, 1.0 - 1e-6)).all(axis=1)
    assert (found.cells.ravel()[wall] == OCCUPIED).all()
    assert (known[inside]).all()
    assert known.sum() == pytest.approx(600, abs=40)  # the same area
    assert found.occupied.sum() == pytest.approx(45, abs=8)


def test_a_yaw_in_the_file_is_applied(folder):
    """A quarter turn about (-1, 2.5): the image's right is up, its 3 columns are 3 rows."""
    grid = read_ros_map(rewrite(folder, "2.5, 0.0]", f"2.5, {pi / 2}]"))
    assert grid.cells.shape == (3, 2)
    assert grid.origin == pytest.approx((-1.1, 2.5))
    assert grid.cells.tolist() == [[OCCUPIED, UNKNOWN], [FREE, OCCUPIED], [UNKNOWN, FREE]]


SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 12))
NUMBERS = st.floats(-500, 500, allow_nan=False)


@settings(deadline=None, max_examples=60)
@given(
    cells=arrays(np.int8, SHAPES, elements=st.sampled_from([FREE, OCCUPIED, UNKNOWN]))
    | arrays(np.int8, SHAPES, elements=st.integers(-1, 100)),
    resolution=st.floats(0.01, 10.0),
    x=NUMBERS,
    y=NUMBERS,
)
def test_what_is_written_reads_back_the_same(tmp_path_factory, cells, resolution, x, y):
    path = tmp_path_factory.getbasetemp() / "round trip's.yaml"
    write_ros_map(OccupancyGrid(cells, resolution, (x, y)), path)
    grid = read_ros_map(path)
    assert np.array_equal(grid.cells, cells)
    assert grid.resolution == resolution and grid.origin == (x, y)
