"""Gazebo world texts made for tests, in the form of the public BARN worlds."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import dedent

GROUND = """
    <light name='sun' type='directional'><pose frame=''>0 0 10 0 -0 0</pose></light>
    <model name='ground_plane'>
      <static>1</static>
      <link name='link'>
        <collision name='collision'>
          <geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
          <surface><friction><ode><mu>100</mu></ode></friction></surface>
        </collision>
      </link>
    </model>
    <gravity>0 0 -9.8</gravity>
    <physics name='default_physics' type='ode'><max_step_size>0.001</max_step_size></physics>
"""


def gazebo_world(inside: str, *, beside: str = "", version: str = "1.6") -> str:
    return (
        f"<sdf version='{version}'>\n  <world name='default'>\n{dedent(inside)}\n  </world>\n"
        f"{dedent(beside)}\n</sdf>\n"
    )


def unit_cylinder(number: int, x: float, y: float, radius: float = 0.075) -> str:
    shape = f"<cylinder><radius>{radius:f}</radius><length>1</length></cylinder>"
    return f"""
    <model name='unit_cylinder_{number}'>
      <static>1</static>
      <pose frame=''>{x:f} {y:f} 0.000000 0.000000 0.000000 0.000000</pose>
      <link name='link'>
        <inertial><mass>1</mass></inertial>
        <collision name='collision'>
          <geometry>{shape}</geometry><max_contacts>10</max_contacts>
        </collision>
        <visual name='visual'><geometry>{shape}</geometry></visual>
        <self_collide>0</self_collide>
      </link>
    </model>"""


def cylinder_world(places: Iterable[tuple[float, float]]) -> str:
    """A world of unit_cylinder models, as the public benchmark's."""
    models = (unit_cylinder(n, x, y) for n, (x, y) in enumerate(places))
    return gazebo_world(GROUND + "".join(models))


def collision_model(
    geometry: str, pose: str = "0 0 0 0 0 0", name: str = "thing", extra: str = "<static>1</static>"
) -> str:
    return f"""
    <model name='{name}'>{extra}
      <pose>{pose}</pose>
      <link name='link'><collision name='body'><geometry>{geometry}</geometry></collision></link>
    </model>"""
