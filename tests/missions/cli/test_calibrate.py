"""`treepilot calibrate camera`: from picture files to the keys of a robot file, and its errors."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from missions.cli.app import app, main
from tests.robots.test_load import ROBOT, read  # noqa: F401 - a fixture
from tests.stack.perception.camera.board_views import DISTORTION, MATRIX, Bench, pictures


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Ten pictures of 320 x 240 pixels and one without a board."""
    place = tmp_path_factory.mktemp("pictures")
    half = np.diag([0.5, 0.5, 1.0]) @ MATRIX
    for number, picture in enumerate(pictures(Bench(half, DISTORTION, (320, 240)), 10, seed=3)):
        cv2.imwrite(str(place / f"{number:02}.png"), picture)
    cv2.imwrite(str(place / "wall.png"), np.full((240, 320), 90, np.uint8))
    (place / "notes.txt").write_text("ignored")
    return place


def calibrated(*words):
    return CliRunner().invoke(app, ["calibrate", "camera", *map(str, words)])


def failure(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["treepilot", "calibrate", "camera", *map(str, words)])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    return capsys.readouterr().err


def test_the_written_keys_are_a_robot_s_camera(folder, tmp_path, read):  # noqa: F811
    out, picture = tmp_path / "camera.yaml", tmp_path / "corners.png"
    result = calibrated(folder, "--write", out, "--picture", picture)
    assert result.exit_code == 0, result.output
    assert "[11/11] wall.png: not used: no board: no markers of DICT_4X4_50" in result.output
    assert "10 pictures, reprojection error (RMS) 0." in result.output
    assert out.read_text() in result.output
    model = read(f"{ROBOT}{out.read_text()}  position: [0.1, 0, 0.3]\n").camera.model
    # Half of MATRIX, from the picture's corner; 1 %, and three of the
    # stated deviations of 1.1 px, which are those of ten small pictures.
    assert (model.fx, model.fy) == pytest.approx((226.0, 224.5), rel=0.01)
    assert (model.cx, model.cy) == pytest.approx((167.25, 118.0), abs=3.4)
    assert cv2.imread(str(picture)).shape == (240, 640, 3)
    again = calibrated(folder, "--write", out, "--terms", "2")
    assert again.exit_code == 0  # its own file is replaced
    assert "0.000000, 0.000000, 0.000000]" in out.read_text()


def test_the_board_is_written_and_found_again(tmp_path):
    board = tmp_path / "board.png"
    result = calibrated("--board", board, "--squares", "6x9", "--square", "25 mm",
                        "--marker", "18 mm", "--dictionary", "DICT_5X5_50")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "6 x 9 squares of 25 mm with markers of 18 mm of DICT_5X5_50" in result.output
    assert "175 x 250 mm" in result.output  # half a square of margin
    height, width = cv2.imread(str(board), cv2.IMREAD_GRAYSCALE).shape
    # 25 mm at 300 dots per inch are 295 pixels, the margin is half of it on each side.
    assert (width, height) == (6 * 295 + 2 * 147, 9 * 295 + 2 * 147)


def test_bad_input_is_an_error(folder, tmp_path, monkeypatch, capsys):
    def error(*words):
        return failure(monkeypatch, capsys, *words)

    small, text = tmp_path / "small.png", tmp_path / "text.png"
    cv2.imwrite(str(small), np.zeros((100, 100), np.uint8))
    text.write_text("not a picture")
    empty = tmp_path / "empty"
    empty.mkdir()
    robot = tmp_path / "robot.yaml"
    robot.write_text(ROBOT)
    assert "is not a picture that OpenCV can read" in error(folder, text)
    assert "has 100 x 100 pixels" in error(folder, small)
    assert "0 of the pictures can be used" in error(folder / "wall.png")
    assert "1 of the pictures can be used" in error(folder / "00.png")
    assert "no picture 'gone.png'" in error("gone.png") or "gone.png" in error("gone.png")
    assert "the folder has no pictures" in error(empty)
    assert "exists and was not written by treepilot" in error(folder, "--write", robot)
    assert robot.read_text() == ROBOT
    assert "--squares 7: expected COLUMNSxROWS" in error(folder, "--squares", "7")
    assert "square: '30 kg' is in kg" in error(folder, "--square", "30 kg")
    assert "--terms 3: expected one of 0, 1, 2, 4, 5" in error(folder, "--terms", "3")
    assert "must end with .png" in error("--board", "board.jpg")
    assert "name pictures of the board" in error()


def test_views_from_one_angle_are_an_error(tmp_path, monkeypatch, capsys):
    half = np.diag([0.5, 0.5, 1.0]) @ MATRIX
    bench = Bench(half, DISTORTION, (320, 240))
    for number, x in enumerate(np.linspace(-0.05, 0.05, 6)):
        picture = bench.picture((0.0, 0.01 * number, 0.0), (x, 0.4 * x, 0.25 + x), seed=number)
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture)
    text = failure(monkeypatch, capsys, tmp_path)
    assert "focal length" in text and "take pictures with the board tilted by 20 to 45 deg" in text


def test_help_imports_no_opencv():
    code = "import sys, missions.cli.app; sys.exit('cv2' in sys.modules)"
    root = Path(__file__).parents[3]
    assert subprocess.run([sys.executable, "-c", code], cwd=root).returncode == 0
