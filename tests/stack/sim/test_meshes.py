from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.sim.physics.meshes import box_prism, file_name, painted, static_meshes
from stack.sim.worlds.world import Box, Cylinder, FloorLine, Wall, World
from stack.types import Pose2D


def volume(corners):
    """By the divergence theorem; right only where every face looks outwards."""
    return np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6


def whole(world):
    return np.concatenate(list(static_meshes(world).values()))


number = st.floats(0.1, 4.0)


@settings(deadline=None, max_examples=50)
@given(number, number, number, st.floats(-4.0, 4.0))
def test_a_box_encloses_its_volume_whichever_way_it_is_turned(length, width, height, heading):
    corners = box_prism(Pose2D(1.0, -2.0, heading), (length, width, height))
    assert corners.shape == (12, 3, 3)
    assert volume(corners) == pytest.approx(length * width * height)


def test_a_cylinder_is_a_prism_of_thirty_two_sides():
    world = World("w", (0, 0, 1, 1), cylinders=(Cylinder(2.0, 1.0, 0.5, height=2.0),))
    corners = whole(world)
    # n / 2 r^2 sin(2 pi / n) h
    assert volume(corners) == pytest.approx(16 * 0.25 * np.sin(2 * np.pi / 32) * 2.0)


def test_joints_of_a_wall_are_filled():
    wall = Wall(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]), thickness=0.2)
    corners = whole(World("w", (0, 0, 2, 2), walls=(wall,)))
    outermost = (corners.reshape(-1, 3)[:, :2] @ np.array([1.0, -1.0]) / sqrt(2)).max()
    # Slabs alone reach (2, 0) + 0.1 aside; the pillar reaches 0.1 along the diagonal
    # (11 of 12 sides' corners lie on the circle, cos(15 deg) where none does).
    assert outermost - 2.0 / sqrt(2) >= 0.1 * np.cos(np.pi / 12) - 1e-12


def test_one_mesh_for_each_colour():
    grey, brown = (0.5, 0.5, 0.5), (0.6, 0.4, 0.3)
    boxes = [
        Box(Pose2D(n, 0.0), (0.5, 0.5, 0.5), colour=c) for n, c in enumerate([grey, brown, grey])
    ]
    meshes = static_meshes(World("w", (0, 0, 1, 1), boxes=tuple(boxes)))
    assert {colour: len(mesh) for colour, mesh in meshes.items()} == {grey: 24, brown: 12}


def test_an_empty_world_has_no_mesh():
    assert static_meshes(World("w", (0, 0, 1, 1))) == {}


def test_files_are_named_by_content():
    assert file_name("a", "obj") == file_name(b"a", "obj") != file_name("b", "obj")


def area(corners):
    sides = np.diff(corners, axis=1)
    return np.cross(sides[:, 0], sides[:, 1])[:, 2].sum() / 2


def test_paint_faces_up_and_covers_length_times_width_also_around_a_corner():
    # A mitred corner loses inside what it gains outside: 3 m x 0.1 m.
    line = FloorLine(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]), width=0.1)
    assert area(painted(line)) == pytest.approx(0.3)


def test_paint_of_a_closed_line_closes_its_corner():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]])
    mesh = painted(FloorLine(square, width=0.1))
    assert area(mesh) == pytest.approx(8 * 0.1)
    assert np.abs(mesh[:, :, :2] - 1.0).max() == pytest.approx(1.05)
