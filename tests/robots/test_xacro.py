"""xacro files: expanded without ROS, and what is wrong in them is a finding."""

import pytest

from robots.load import read_robot
from robots.urdf.reading import UrdfSource, read_urdf
from stack.errors import InputError

pytest.importorskip("xacro")

WHEEL = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="name side">
    <link name="${name}_link">
      <inertial><mass value="0.2"/><inertia ixx="2e-4" iyy="2e-4" izz="2e-4"/></inertial>
      <collision><geometry><sphere radius="${radius}"/></geometry></collision>
    </link>
    <joint name="${name}" type="continuous">
      <parent link="base"/><child link="${name}_link"/><axis xyz="0 1 0"/>
      <origin xyz="0 ${side * separation / 2} ${radius}"/>
    </joint>
  </xacro:macro>
</robot>
"""
CART = """<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="separation" default="0.3"/>
  <xacro:property name="separation" value="$(arg separation)"/>
  <xacro:property name="radius" value="${10 / 200}"/>
  <xacro:include filename="$(find cart_parts)/wheel.xacro"/>
  <link name="base">
    <inertial><mass value="3"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
  </link>
  <xacro:wheel name="left" side="1"/>
  <xacro:wheel name="right" side="-1"/>
</robot>
"""
ROBOT = """robot: cart
footprint: {radius: 25 cm}
height: 0.3
urdf: URDF
wheels: {left: [left], right: [right], radius: 5 cm, separation: SEPARATION}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.chdir(tmp_path)
    parts = tmp_path / "elsewhere" / "cart_parts"
    parts.mkdir(parents=True)
    (parts / "wheel.xacro").write_text(WHEEL)
    (tmp_path / "cart.urdf.xacro").write_text(CART)
    return tmp_path


def robot(folder, urdf, separation="0.3"):
    text = ROBOT.replace("URDF", urdf).replace("SEPARATION", separation)
    (folder / "robot.yaml").write_text(text)
    return read_robot(folder / "robot.yaml")


def test_a_xacro_file_is_a_robot(folder):
    found = robot(folder, "{file: cart.urdf.xacro, packages: [elsewhere]}")
    assert found.warnings == ()
    assert found.model.count("<sphere") == 2 and 'xyz="0.0 0.15 0.05"' in found.model.replace(
        "0 0.15", "0.0 0.15"
    )


def test_arguments_reach_the_file(folder):
    urdf = "{file: cart.urdf.xacro, packages: [elsewhere], arguments: {separation: 0.4}}"
    assert robot(folder, urdf, "0.4").warnings == ()
    with pytest.raises(InputError, match=r"separation is 0\.3 m, but 0\.4 m in the URDF"):
        robot(folder, urdf, "0.3")


def one_finding(path, packages=()):
    with pytest.raises(InputError) as caught:
        read_urdf(UrdfSource(path, packages))
    (found,) = caught.value.findings
    assert found.code == "E302"
    return found


def test_a_package_that_is_not_found_is_one_finding_with_the_way_out(folder):
    found = one_finding(folder / "cart.urdf.xacro")
    assert found.sentence == "xacro: the package 'cart_parts' is not found"
    assert "urdf: {file: cart.urdf.xacro, packages: [FOLDER]}" in found.hint
    assert "`treepilot new robot --packages FOLDER`" in found.hint


def test_an_argument_without_value_says_where_to_set_it(folder):
    path = folder / "cart.urdf.xacro"
    path.write_text(CART.replace("$(arg separation)", "$(arg other)"))
    found = one_finding(path, (folder / "elsewhere",))
    assert "arguments: {NAME: VALUE}" in found.hint
    assert "`treepilot new robot --set NAME=VALUE`" in found.hint


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("$(arg separation)", "$(arg other)", "Undefined substitution argument"),
        ("${10 / 200}", "${10 / 0}", "division by zero"),
        ("${10 / 200}", "${().__class__}", "xacro: "),
        ("wheel.xacro", "wheels.xacro", "No such file"),
        ('<xacro:wheel name="left"', '<xacro:wheels name="left"', "wheels"),
        ("</robot>", "", "no element found"),
    ],
)
def test_what_is_wrong_in_a_xacro_file_is_a_finding(folder, old, new, expected):
    path = folder / "cart.urdf.xacro"
    path.write_text(CART.replace(old, new))
    assert expected in one_finding(path, (folder / "elsewhere",)).sentence


def test_an_error_in_an_included_file_is_found_there(folder):
    wheel = folder / "elsewhere" / "cart_parts" / "wheel.xacro"
    wheel.write_text(WHEEL.replace("${radius}", "${raduis}"))
    found = one_finding(folder / "cart.urdf.xacro", (folder / "elsewhere",))
    assert "raduis" in found.sentence


def test_values_of_the_expanded_file_are_checked_like_those_of_a_urdf(folder):
    path = folder / "cart.urdf.xacro"
    path.write_text(CART.replace("${10 / 200}", "${-1}"))
    with pytest.raises(InputError) as caught:
        read_urdf(UrdfSource(path, (folder / "elsewhere",)))
    found = caught.value.findings[0]
    assert found.mark.file.endswith("cart.urdf.xacro (expanded)")
    assert found.sentence.startswith("<sphere>: radius: expected 1e-06 to 100, got '-1'")
