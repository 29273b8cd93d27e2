"""Errors found before anything is built: a start inside an obstacle, a world without a place."""

import pytest

from missions.execution.prepare import RunOptions, prepare
from stack.errors import InputError


def refusal(name="01_drive_to_a_point", **options):
    with pytest.raises(InputError) as caught:
        prepare(name, RunOptions(**options))
    return str(caught.value)


def test_a_start_outside_the_world_names_its_places():
    words = refusal(start="100,2,0")
    assert "(100, 2) is outside small room, which covers x " in words
    assert "start at one of its places: home, dock" in words


def test_a_start_inside_a_wall_is_refused():
    # the west wall of small_room runs along x = 0; the scout's radius is 0.22 m
    assert "collides with " in refusal(start="0.2,2.0,0")
    prepare("01_drive_to_a_point", RunOptions(start="0.5,2.0,0"))


def test_a_mission_file_with_a_bad_start_is_found_at_its_line(tmp_path):
    path = tmp_path / "far.yaml"
    path.write_text(
        "mission: far\nformat: 1\nrobot: scout\nworld: office\nstart: [50, 50]\n"
        "run: {say: hello}\n",
        "utf-8",
    )
    assert refusal(path).startswith(f"{path}:5:8 error[E412]")


def test_another_world_is_what_places_are_looked_up_in():
    words = refusal("02_office_patrol", world="small_room")
    assert "there is no $desk_a" in words or "there is no $desk_c" in words


@pytest.mark.parametrize("text", ["1", "a,b", "1,2,3,4", "1 deg,2"])
def test_a_start_that_is_no_pose_is_refused(text):
    assert "--start" in refusal(start=text)


def test_degrees_are_understood_on_the_command_line():
    plan = prepare("01_drive_to_a_point", RunOptions(start="1.0,1.5,90 deg"))
    assert plan.start.heading == pytest.approx(1.5708, abs=1e-4)


def large(folder, side, mission="map: from_world\n"):
    """A mission on its third line in a square world with walls along its edge, metres."""
    corners = f"[[0, 0], [{side}, 0], [{side}, {side}], [0, {side}]]"
    (folder / "large.yaml").write_text(
        f"world: large\nbounds: [0, 0, {side}, {side}]\nstart: [2, 2, 0]\n"
        f"walls: [{{points: {corners}, closed: true}}]\n", "utf-8",
    )  # fmt: skip
    file = folder / "mission.yaml"
    file.write_text(
        f"mission: large\nrobot: scout\nworld: ./large.yaml\n{mission}run: {{say: hello}}\n",
        "utf-8",
    )
    return file


def test_the_map_of_a_world_may_have_8192_cells_a_side(tmp_path):
    # 8192 cells of 2.5 cm are 204.8 m
    prepare(large(tmp_path, 204.8), RunOptions())


def test_a_world_too_large_for_the_costmaps_names_the_smallest_cells_that_fit(tmp_path):
    file = large(tmp_path, 205)
    # 205 m / 2.5 cm = 8200; 205 m / 8192 = 2.502 cm, in whole centimetres 3 cm
    assert refusal(file) == (
        f"{file}:3:8 error[E413] large is 205 x 205 m: its map would have 67240000 cells of"
        " 0.025 m, at most 67108864 are possible;"
        " set `navigation: {costmap: {map_resolution: 0.03}}`"
    )
    wider = "navigation: {costmap: {map_resolution: 0.03}}\n"
    prepare(large(tmp_path, 205.5, wider), RunOptions())


def test_a_world_too_large_for_the_localisation_can_only_be_driven_without_a_map(tmp_path):
    wide = "navigation: {costmap: {map_resolution: 0.5}}\n"
    file = large(tmp_path, 1000, wide)
    words = refusal(file)
    assert (
        "error[E413] large is 1000 x 1000 m: its map would have 400000000 cells of 0.05 m" in words
    )
    assert words.endswith("use `map: none`, or set closer `bounds` in the world file")
    prepare(large(tmp_path, 1000, "map: none\n"), RunOptions())


def test_a_world_of_ten_kilometres_is_refused_at_its_coordinates(tmp_path):
    assert "large.yaml:2:16 error[E201]" in refusal(large(tmp_path, 10_000))


@pytest.mark.parametrize("text", ["48.1", "a,b", "nan,11", "91,11", "48,181"])
def test_an_origin_that_is_no_place_on_earth_is_refused(text):
    assert "--origin" in refusal(origin=text)


def test_an_origin_of_the_command_line_replaces_that_of_the_world():
    plan = prepare("44_ground_station", RunOptions(origin="-33.9,151.2"))
    assert (plan.world.origin.latitude, plan.world.origin.longitude) == (-33.9, 151.2)
