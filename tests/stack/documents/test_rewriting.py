"""Values are changed in place: comments, order and layout stay."""

import pytest
import yaml

from stack.documents.rewriting import with_values

TEXT = """\
robot: scout   # ours
wheels:
  left: [l]        # joint
  radius: 7.5 cm   # of the data sheet
  separation: 29 cm

# sensors
lidar: {position: [0, 0], rate: 10 Hz}   # upside up
imu:
  rate: 100 Hz
"""


def test_only_the_values_change():
    changed = with_values(
        TEXT,
        {
            ("wheels", "radius"): "7.62 cm",
            ("wheels", "effective_radii"): "[7.6 cm, 7.7 cm]",
            ("lidar", "position"): "[1 cm, 0]",
            ("lidar", "yaw"): "1 deg",
            ("imu", "gyro_scale"): "1.01",
            ("odometry", "slip"): "1 %",
        },
    )
    assert (
        changed
        == """\
robot: scout   # ours
wheels:
  left: [l]        # joint
  radius: 7.62 cm   # of the data sheet
  separation: 29 cm
  effective_radii: [7.6 cm, 7.7 cm]

# sensors
lidar: {position: [1 cm, 0], rate: 10 Hz, yaw: 1 deg}   # upside up
imu:
  rate: 100 Hz
  gyro_scale: 1.01
odometry: {slip: 1 %}
"""
    )


@pytest.mark.parametrize(
    "text",
    [
        "a: 1",
        "a: 1  # no end of line",
        "b:\na: {}\n",
        "é: ü # ß\na: 'x: y'\n",
        "a:\n  - 1\n  - 2\n",
    ],
)
def test_what_is_set_is_read_back(text):
    changed = with_values(text, {("a",): "7", ("b", "c"): "2", ("b", "d"): "3"})
    found = yaml.safe_load(changed)
    assert (found["a"], found["b"]) == (7, {"c": 2, "d": 3})


def test_a_path_through_a_number_is_refused():
    with pytest.raises(ValueError, match="radius"):
        with_values("wheels: 3\n", {("wheels", "radius"): "1"})
