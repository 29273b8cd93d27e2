"""Models that a Gazebo world includes: where they are found, how they are placed, what is said."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from stack.errors import InputError
from stack.sim.import_world import read_any_world
from stack.sim.sdf.model_path import VARIABLES
from stack.sim.worlds.world import World
from tests.stack.sim.gazebo_text import collision_model, gazebo_world

CRATE = "<box><size>2 1 0.6</size></box>"


@pytest.fixture(autouse=True)
def nothing_installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No models of this computer: neither in Gazebo's variables nor in the home folder."""
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))


def add_model(folder: Path, inside: str = "", versions: tuple[str, ...] = ("1.6",)) -> None:
    """A model folder; each version of the model is in a file of its own."""
    folder.mkdir(parents=True)
    listed = "".join(f"<sdf version='{v}'>model-{v}.sdf</sdf>" for v in versions)
    (folder / "model.config").write_text(f"<model><name>x</name>{listed}</model>")
    for version in versions:
        model = inside or collision_model(CRATE, "0 0 0.3 0 0 0", f"crate_{version}")
        (folder / f"model-{version}.sdf").write_text(f"<sdf version='{version}'>{model}</sdf>")


def world_of(folder: Path, inside: str) -> World:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "w.world").write_text(gazebo_world(inside))
    return read_any_world(folder / "w.world")


def include(uri: str, pose: str = "5 0 0.3 0 0 0", extra: str = "") -> str:
    return f"<include><uri>{uri}</uri><pose>{pose}</pose>{extra}</include>"


@pytest.mark.parametrize(
    ("place", "uri"),
    [
        ("pkg/worlds/crate", "model://crate"),
        ("pkg/worlds/models/crate", "model://crate"),
        ("pkg/models/crate", "model://crate/"),
        ("pkg/models/crate", "file://models/crate"),
        ("pkg/models/crate", "package://pkg/models/crate"),
        ("pkg/models/crate", "../models/crate"),
        ("pkg/models/crate", "model://crate/model-1.6.sdf"),
        ("pkg/models/crate", "https://fuel.gazebosim.org/1.0/Somebody/models/Crate"),
        ("pkg/models/big_crate", "https://fuel.gazebosim.org/1.0/Somebody/models/Big Crate"),
        ("home/.gazebo/models/crate", "model://crate"),
        ("home/.gz/fuel/fuel.gazebosim.org/somebody/models/crate/3",
         "https://fuel.gazebosim.org/1.0/Somebody/models/Crate"),
    ],
)  # fmt: skip
def test_a_model_is_found_beside_its_world_and_where_gazebo_keeps_models(
    tmp_path: Path, place: str, uri: str
) -> None:
    add_model(tmp_path / place)
    world = world_of(tmp_path / "pkg" / "worlds", include(uri))
    assert [(box.pose.x, box.size) for box in world.boxes] == [(5.0, (2.0, 1.0, 0.6))]
    assert world.warnings == ()


@pytest.mark.parametrize("variable", VARIABLES)
def test_a_model_is_found_in_the_path_of_an_environment_variable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    add_model(tmp_path / "far" / "away" / "crate")
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path}/far/away")
    assert len(world_of(tmp_path / "a" / "b" / "c", include("model://crate")).boxes) == 1


def test_the_newest_version_of_a_model_that_can_be_read_is_used(tmp_path: Path) -> None:
    """1.10 is newer than 1.5, and 9.9 than every format that there is."""
    add_model(tmp_path / "crate", versions=("1.5", "1.10", "9.9", "1.4"))
    assert world_of(tmp_path, include("model://crate")).boxes[0].name == "crate_1.10"


def test_a_model_without_a_readable_config_is_read_from_its_model_file(tmp_path: Path) -> None:
    add_model(tmp_path / "crate")
    (tmp_path / "crate" / "model-1.6.sdf").rename(tmp_path / "crate" / "model.sdf")
    (tmp_path / "crate" / "model.config").write_text("<model><author>a & b</author></model>")
    world = world_of(tmp_path, include("model://crate"))
    assert len(world.boxes) == 1
    assert world.warnings[0].mark.file.endswith("model.config")
    (tmp_path / "crate" / "model.config").unlink()
    assert world_of(tmp_path, include("model://crate")).warnings == ()


def test_a_mesh_is_found_beside_its_model_and_below_the_models(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    for uri in ("model://crate/meshes/m.stl", "meshes/m.stl", "file://models/crate/meshes/m.stl",
                "package://crate/meshes/m.stl"):  # fmt: skip
        folder = tmp_path / str(abs(hash(uri))) / "models" / "crate"
        add_model(folder, collision_model(f"<mesh><uri>{uri}</uri></mesh>", "0 0 0.5 0 0 0"))
        (folder / "meshes").mkdir()
        trimesh.creation.box(extents=(1, 1, 1)).export(folder / "meshes" / "m.stl")
        world = world_of(folder.parents[1] / "worlds", include("model://crate"))
        assert [box.size for box in world.boxes] == [pytest.approx((1.0, 1.0, 0.8))], uri


def test_included_models_include_others_and_poses_compose(tmp_path: Path) -> None:
    """A pair of crates 2 m apart along its y axis, turned by 90 degrees: along -x of the world.

    The second stands relative to the first, the third relative to the pair by its name.
    """
    pair = ("<model name='pair'>" + include("model://crate", "0 0 0 0 0 0", "<name>one</name>")
            + "<include><uri>model://crate</uri><pose relative_to='one'>0 2 0 0 0 0</pose>"
            "</include></model>")  # fmt: skip
    add_model(tmp_path / "crate")
    add_model(tmp_path / "pair", pair)
    world = world_of(
        tmp_path,
        include("model://pair", f"10 0 0.3 0 0 {pi / 2}", "<name>twins</name>")
        + "<include><uri>model://crate</uri><pose relative_to='twins'>0 5 0 0 0 0</pose></include>",
    )
    assert [box.pose.x for box in world.boxes] == pytest.approx([10.0, 8.0, 5.0])


def test_static_saved_state_and_placement_frame_of_an_include(tmp_path: Path) -> None:
    body = "<link name='l'><pose>3 0 0 0 0 0</pose><collision name='c'><geometry>"
    add_model(tmp_path / "loose", f"<model name='loose'>{body}{CRATE}</geometry></collision></link>"
                                  "</model>")  # fmt: skip
    world = world_of(tmp_path, include("model://loose", "9 0 0.3 0 0 0"))
    assert "not static in Gazebo, static here" in world.warnings[0].sentence
    assert world.boxes[0].pose.x == pytest.approx(12.0)
    still = world_of(tmp_path, include("model://loose", "9 0 0.3 0 0 0", "<static>1</static>"))
    assert still.warnings == ()
    placed = include("model://loose", "9 0 0.3 0 0 0", "<placement_frame>l</placement_frame>")
    assert world_of(tmp_path, placed).boxes[0].pose.x == pytest.approx(9.0)
    state = "<state><model name='mine'><pose>0 7 0.3 0 0 0</pose></model></state>"
    moved = world_of(tmp_path, include("model://loose", extra="<name>mine</name>") + state)
    assert (moved.boxes[0].pose.x, moved.boxes[0].pose.y) == pytest.approx((3.0, 7.0))


def test_a_world_whose_models_are_missing_names_them_and_says_where_it_looked(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError) as refused:
        world_of(tmp_path / "worlds", include("model://shelf") + include("model://table"))
    empty, missing = refused.value.findings
    assert (empty.code, empty.severity) == ("E206", "error")
    assert (missing.code, missing.severity) == ("W208", "warning")
    assert missing.sentence == (
        "<include> of models that are not found is ignored: model://shelf, model://table"
    )
    assert str(tmp_path / "worlds") in missing.hint and "GZ_SIM_RESOURCE_PATH" in missing.hint


def test_models_that_include_each_other_are_an_error(tmp_path: Path) -> None:
    add_model(tmp_path / "a", "<model name='a'>" + include("model://b") + "</model>")
    add_model(tmp_path / "b", "<model name='b'>" + include("model://a") + "</model>")
    with pytest.raises(InputError, match=r"the model 'a' includes itself: a -> b -> a"):
        world_of(tmp_path, include("model://a") + collision_model(CRATE))


def test_a_model_of_the_path_is_not_confused_with_a_model_of_the_world(tmp_path: Path) -> None:
    """As in many public worlds: <model name='hall'> only includes model://hall."""
    add_model(tmp_path / "hall")
    world = world_of(tmp_path, "<model name='hall'>" + include("model://hall") + "</model>")
    assert len(world.boxes) == 1


def test_models_that_multiply_are_refused(tmp_path: Path) -> None:
    """Each of 16 models includes the next one twice: 65535 in all."""
    for n in range(16):
        inside = 2 * include(f"model://m{n + 1}") if n < 15 else ""
        add_model(tmp_path / f"m{n}", f"<model name='m{n}'>{inside}</model>")
    with pytest.raises(InputError, match=r"E205.*more than 20000 models"):
        world_of(tmp_path, include("model://m0"))


def test_a_damaged_model_is_reported_at_its_place(tmp_path: Path) -> None:
    add_model(tmp_path / "crate", "<model name='crate'>")
    with pytest.raises(InputError) as refused:
        world_of(tmp_path, include("model://crate") * 3)
    (finding,) = refused.value.findings
    assert finding.code == "E207" and finding.mark.file.endswith("crate/model-1.6.sdf")
