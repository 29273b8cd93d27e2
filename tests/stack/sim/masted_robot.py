"""A robot with a mast that its lidar sees, as files."""

ROBOT = """\
robot: masted
footprint: {radius: 20 cm}
height: 60 cm
urdf: masted.urdf
wheels: {left: [left], right: [right], radius: 8 cm, separation: 32 cm}
lidar: {height: 30 cm, range_min: 5 cm}
"""

LINK = """\
<link name="{name}">
  <inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>
  </inertial>
  <collision><origin xyz="{at}"/><geometry>{shape}</geometry></collision>
</link>
"""
JOINT = """\
<joint name="{name}" type="{kind}"><parent link="base"/><child link="{child}"/>
  <origin xyz="{at}"/><axis xyz="0 1 0"/></joint>
"""


def masted(folder, *, at="0.4 0 0", radius=0.025, length=0.6, housing="0 0 0.3"):
    """A robot with a housing around its lidar, and a mast in a link of its own."""
    wheel = '<sphere radius="0.08"/>'
    parts = [
        LINK.format(name="base", at="0 0 0.12", shape='<box size="0.2 0.2 0.1"/>'),
        LINK.format(name="housing", at=housing, shape='<cylinder radius="0.04" length="0.06"/>'),
        LINK.format(
            name="mast", at="0 0 0.3", shape=f'<cylinder radius="{radius}" length="{length}"/>'
        ),
        JOINT.format(name="housing", kind="fixed", child="housing", at="0 0 0"),
        JOINT.format(name="mast", kind="fixed", child="mast", at=at),
    ]
    for side, y in (("left", 0.16), ("right", -0.16)):
        parts.append(LINK.format(name=f"{side}_link", at="0 0 0", shape=wheel))
        where = f"0 {y} 0.08"
        parts.append(JOINT.format(name=side, kind="continuous", child=f"{side}_link", at=where))
    (folder / "masted.urdf").write_text(f'<robot name="masted">{"".join(parts)}</robot>')
    (folder / "robot.yaml").write_text(ROBOT)
    return folder / "robot.yaml"
