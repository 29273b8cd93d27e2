"""The scenes of the bench among people: their worlds, and one real run."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from missions.bench.flats import make_flat
from missions.bench.people_runs import FailureCodes, PeopleEntry
from stack.errors import InputError
from stack.sim.people import People
from stack.sim.worlds.world_file import read_world
from stack.telemetry.records import Event
from tests.benchmarks.benches.people import (
    CROWD,
    OFFICE,
    OFFICE_PEOPLE,
    PEOPLE,
    RECORDED,
    SCENES,
    entries_of,
    group_of,
    make_scene,
    scene_names,
    table_of,
)
from tests.benchmarks.benchmark import MoreOptions


def entry(tmp_path, scene, people="unaware", seed=0) -> PeopleEntry:
    return PeopleEntry(scene, "scout", people, seed, make_scene, MoreOptions(tmp_path))


@pytest.mark.parametrize("scene", [*SCENES, OFFICE])
def test_every_scene_is_a_world_in_which_nobody_begins_at_the_robot(tmp_path, scene):
    case = make_scene(entry(tmp_path, scene))
    world = read_world(case.file)
    assert len(world.people) == case.people > 0
    for x, y in People(world, 0).positions:
        assert np.hypot(x - world.start.x, y - world.start.y) > 1.0
    assert make_scene(entry(tmp_path, scene)).argument == case.argument


@pytest.mark.parametrize("make", [make_scene, make_flat])
def test_the_file_of_a_world_is_never_half_written(tmp_path, monkeypatch, make):
    """Processes with other robots read the file while one finds that it is of another version."""
    made = PeopleEntry("crowd", "scout", "unaware", 2, make, MoreOptions(tmp_path))
    file = make(made).file
    text = file.read_text("utf-8")
    file.write_text("old", "utf-8")
    seen, rename = [], os.replace

    def replaced(source, target):
        seen.append((Path(source).read_text("utf-8"), Path(target).read_text("utf-8")))
        rename(source, target)

    monkeypatch.setattr("os.replace", replaced)
    make(made)
    assert seen == [(text, "old")]
    assert file.read_text("utf-8") == text
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_counts_and_models_are_those_of_the_names(tmp_path):
    for scene, count in {"corridor 1.4 m, 4 oncoming": 4, "crossing, 3": 3, "crowd": CROWD}.items():
        people = read_world(make_scene(entry(tmp_path, scene, "social_force")).file).people
        assert [person.model for person in people] == ["social_force"] * count
    office = read_world(make_scene(entry(tmp_path, OFFICE, "polite")).file)
    assert [person.yields for person in office.people] == [True] * OFFICE_PEOPLE
    assert read_world(make_scene(entry(tmp_path, OFFICE, "none")).file).people == ()


def test_recorded_tracks_get_a_hall_round_them(tmp_path):
    tracks = tmp_path / "square.txt"
    lines = [f"{10 * n} 1 {2.0 + 0.1 * n} 3.0" for n in range(60)]
    tracks.write_text("\n".join(lines) + "\n", "utf-8")
    case = make_scene(entry(tmp_path, f"{RECORDED}{tracks}"))
    world = read_world(case.file)
    assert {person.model for person in world.people} == {"recorded"}
    # tracks from x = 2 to 7.9 m and 1 m of margin: the robot crosses the longer side
    assert world.start.x == pytest.approx(1.6, abs=0.1)
    assert case.goals[0].x == pytest.approx(8.3, abs=0.1)
    with pytest.raises(InputError, match=r"--tracks .*missing\.txt"):
        make_scene(entry(tmp_path, f"{RECORDED}{tmp_path / 'missing.txt'}"))


def test_scenes_are_chosen_by_the_begin_of_their_names(tmp_path):
    assert len(scene_names((), ())) == len(SCENES) + 1
    assert scene_names(("corridor 1.2", "office"), ())[-1] == OFFICE
    assert len(scene_names(("corridor 1.2",), ())) == 4
    with pytest.raises(InputError, match="no scene begins with 'corner'; there are corridor"):
        scene_names(("corner",), ())
    made = entries_of(MoreOptions(
        tmp_path, names=("crowd", OFFICE, RECORDED), robots=("scout",),
        people=("none", "social_force"), files=(Path("a.txt"),),
    ))  # fmt: skip
    assert [item.key for item in made] == [
        ("crowd", "scout", "social_force", 0), ("office", "scout", "none", 0),
        ("office", "scout", "social_force", 0), (f"{RECORDED}a.txt", "scout", "unaware", 0),
    ]  # fmt: skip
    assert group_of("corridor 1.2 m, 1 ahead") == "corridor 1.2 m"
    assert group_of(f"{RECORDED}/x/zara.txt") == "recorded zara"


def test_a_meeting_in_a_corridor(tmp_path):
    row = PEOPLE.row(entry(tmp_path, "corridor 2 m, 1 oncoming", "social_force"), tmp_path)
    assert (row.status, row.visited, row.drove_into) == ("passed", 1, 0)
    (shown,) = table_of([row])
    assert (shown["scene"], shown["all goals"]) == ("corridor 2 m", "1/1")
    assert PEOPLE.report([row])[0].startswith("scene")


def test_contacts_with_people_are_not_contacts_with_things():
    codes = FailureCodes()
    for touched, is_person in (("walker 1", True), ("person-sized crate", False)):
        fields = {"touched": touched, "is_person": is_person, "at": [1.0, 2.0]}
        text = f"contact with {touched} at (1.00, 2.00)"
        codes.event(Event(0, 0, 1.0, "info", "simulation", "contact", text, fields))
    assert codes.things == 1


def test_a_plan_that_fails_is_no_failed_drive():
    codes = FailureCodes()
    for what, moves in (("plan", False), ("drive", True)):
        fields = {"status": "failed", "code": "NO_VALID_PATH", "moves": moves}
        codes.event(Event(0, 0, 1.0, "warning", "navigation", "task", f"{what} failed", fields))
    assert (codes.codes, codes.last) == ({"NO_VALID_PATH": 1}, "drive failed")
