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
