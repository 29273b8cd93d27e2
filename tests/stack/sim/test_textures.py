import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.errors import InputError
from stack.sim.physics.meshes import (
    box_prism,
    plain_meshes,
    static_meshes,
    textured_meshes,
    tiled_obj_text,
)
from stack.sim.physics.textures import TILE_SIDES, poster_picture, texture_picture
from stack.sim.sensors.rendering import CameraRenderer, RenderRequest, RenderSetup
from stack.sim.worlds.world import TEXTURES, Box, Poster, Wall, World
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D
from tests.stack.sim.sim_rover import CAMERA, EMPTY, ROVER

FACING = RenderRequest(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), np.zeros((0, 3)), {})
QUIET = replace(CAMERA, noise=0.0)


def picture(world):
    renderer = CameraRenderer(RenderSetup(world, ROVER.model, QUIET))
    try:
        return renderer.render(FACING).astype(int)
    finally:
        renderer.close()


def read(tmp_path, text):
    path = tmp_path / "w.yaml"
    path.write_text("world: w\nwalls: [{points: [[0, 0], [9, 0]]}]\nstart: [5, 2]\n" + text)
    return read_world(path)


def test_posters_and_textures_are_read(tmp_path):
    world = read(
        tmp_path,
        "floor: carpet\n"
        "boxes: [{at: [3, 3, 0], size: [1, 1, 1], texture: wood}]\n"
        "posters:\n"
        "  - {id: 4, at: [2, 0.06], facing: 90 deg, height: 50 cm, size: [1, 80 cm]}\n"
        "  - {id: 4, at: [4, 0.06], facing: 90 deg}\n",
    )
    assert (world.floor, world.walls[0].texture, world.boxes[0].texture) == (
        "carpet", "plain", "wood",
    )  # fmt: skip
    assert world.posters[0] == Poster(4, (2.0, 0.06, 0.5), pi / 2, (1.0, 0.8))
    assert world.posters[1].size == (0.6, 0.45)


@pytest.mark.parametrize(
    "text, expected",
    [
        ("floor: lawn", "floor: 'lawn' is not one of plain, wallpaper, wood, brick, carpet, tiles"),
        ("posters: [{at: [2, 1], facing: 0}]", "a poster needs the key 'id'"),
        ("posters: [{id: -1, at: [2, 1], facing: 0}]", "id: -1 must be at least 0"),
        ("posters: [{id: 3, at: [2, 0], facing: 0}]", "poster 3 at [2, 0] is 5.0 cm inside a wall"),
        ("posters: [{id: 1, at: [2, 1], facing: 0, size: [0, 1]}]", "width: 0 m must be above 0"),
    ],
)
def test_a_mistake_in_a_poster_or_texture_is_reported(tmp_path, text, expected):
    with pytest.raises(InputError, match=re.escape(expected)):
        read(tmp_path, text)


def test_a_texture_repeats_along_a_wall_and_stands_upright():
    corners = box_prism(Pose2D(1.0, 2.0, 0.7), (3.0, 0.1, 1.0))
    lines = tiled_obj_text(corners, 0.5).splitlines()
    numbers = [[float(part) for part in line.split()[1:]] for line in lines if line[:2] == "vt"]
    tiles = np.array(numbers).reshape(-1, 3, 2)
    spans = np.ptp(tiles, axis=1)
    # Each long side is 3 m / 0.5 m = 6 tiles wide and 1 m / 0.5 m = 2 high: 2 sides, 2 triangles.
    assert np.isclose(spans, (6.0, 2.0), atol=1e-5).all(axis=1).sum() == 4
    assert tiles.min() >= 0.0  # the renderer does not repeat negative coordinates


@pytest.mark.parametrize("name", [name for name in TEXTURES if name != "plain"])
def test_the_opposite_edges_of_a_texture_fit_together(name):
    tile = texture_picture(name).astype(float)
    assert tile.shape == (128, 128, 3) and name in TILE_SIDES
    for axis in (0, 1):
        steps = np.abs(np.diff(tile, axis=axis)).mean(axis=(1 - axis, 2))
        seam = np.abs(tile.take(0, axis) - tile.take(-1, axis)).mean()
        assert seam <= 1.1 * steps.max()
    assert (tile == texture_picture(name)).all()


def test_the_number_of_a_poster_is_its_picture():
    assert poster_picture(3, (0.6, 0.45)).shape == (72, 96, 3)  # 160 pixels per metre
    assert (poster_picture(3, (0.6, 0.45)) == poster_picture(3, (0.6, 0.45))).all()
    difference = np.abs(poster_picture(3, (0.6, 0.45)).astype(int) - poster_picture(4, (0.6, 0.45)))
    assert difference.mean() > 20.0


def test_a_poster_is_drawn_where_the_camera_model_says():
    wall = replace(EMPTY, boxes=(Box(Pose2D(2.05, 0.0), (0.1, 3.0, 2.0)),))
    x, y, z = CAMERA.model.position
    poster = Poster(5, (1.99, y + 0.2, z + 0.1), pi, (0.6, 0.4))
    changed = np.abs(picture(replace(wall, posters=(poster,))) - picture(wall)).sum(axis=2) > 12
    rows, columns = np.nonzero(changed)
    scale = CAMERA.model.focal_length / (1.99 - 0.002 - x)
    middle = CAMERA.model.width / 2 - 0.2 * scale, CAMERA.model.height / 2 - 0.1 * scale
    assert (columns.min() + columns.max() + 1) / 2 == pytest.approx(middle[0], abs=1.0)
    assert (rows.min() + rows.max() + 1) / 2 == pytest.approx(middle[1], abs=1.0)
    assert np.ptp(columns) + 1 == pytest.approx(0.6 * scale, abs=1.5)
    assert np.ptp(rows) + 1 == pytest.approx(0.4 * scale, abs=1.5)


def test_what_has_a_texture_is_drawn_once_and_is_solid():
    walls = (
        Wall(np.array([[0.0, 0.0], [2.0, 0.0]]), texture="brick"),
        Wall(np.array([[0.0, 1.0], [2.0, 1.0]])),
    )
    world = World("w", (0, 0, 2, 2), walls=walls)
    count = {
        "solid": sum(len(mesh) for mesh in static_meshes(world).values()),
        "plain": sum(len(mesh) for mesh in plain_meshes(world).values()),
        "textured": sum(len(mesh) for mesh in textured_meshes(world).values()),
    }
    assert count == {"solid": 24, "plain": 12, "textured": 12}  # 12 triangles of a box each
