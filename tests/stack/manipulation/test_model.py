"""Reading of an arm: joints, links, shapes, and what may touch what."""

from dataclasses import replace

import numpy as np
import pytest

from stack.errors import InputError
from stack.manipulation.model import ArmModel
from stack.optional_packages import Package
from tests.stack.manipulation.panda import HOME, LIMITS, PANDA, URDF, panda


def names(model: ArmModel) -> set[frozenset[str]]:
    return {frozenset(map(model.link_of, pair)) for pair in model.self_pairs}


def test_neighbours_and_hulls_that_always_overlap_are_no_contacts():
    pairs = names(panda())
    assert frozenset(("panda_link4", "panda_link5")) not in pairs
    assert frozenset(("panda_leftfinger", "panda_rightfinger")) not in pairs
    assert frozenset(("panda_link0", "panda_hand")) in pairs
    assert frozenset(("panda_link5", "panda_hand")) in pairs


def test_reach_bounds_the_motion_of_every_point_of_the_arm():
    """Vertices of all shapes, moved by 1 mrad of each joint at a time."""
    model, generator = panda(), np.random.default_rng(0)
    pin, data, results = model.pin, model.model.createData(), model.geometry.createData()

    def vertices(positions):
        pin.updateGeometryPlacements(
            model.model, data, model.geometry, results, model.configuration(positions)
        )
        shapes = zip(model.geometry.geometryObjects, results.oMg, strict=True)
        return np.vstack([[pose.act(p) for p in item.geometry.points()] for item, pose in shapes])

    for _ in range(10):
        positions = generator.uniform(LIMITS.lower, LIMITS.upper)
        for joint in range(7):
            moved = positions + 1e-3 * np.eye(7)[joint]
            way = np.linalg.norm(vertices(moved) - vertices(positions), axis=1).max()
            assert way <= 1e-3 * model.reach[joint]


def test_the_text_of_the_urdf_reads_as_the_file():
    model = ArmModel(URDF.read_text(), PANDA, [URDF.parent])
    assert names(model) == names(panda())
    assert model.configuration(HOME, 0.02)[-2:] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"joints": ("panda_joint1", "elbow")}, "no joint 'elbow'"),
        ({"tool_link": "tcp"}, "no link 'tcp'"),
        ({"base_link": "base"}, "no link 'base'"),
    ],
)
def test_names_that_the_urdf_lacks(change, sentence):
    with pytest.raises(InputError, match=sentence):
        ArmModel(URDF, replace(PANDA, **change))


def test_a_file_that_is_no_urdf(tmp_path):
    file = tmp_path / "arm.urdf"
    with pytest.raises(InputError, match=r"arm\.urdf cannot be read"):
        ArmModel(file, PANDA)
    file.write_text("<robot", "utf-8")
    with pytest.raises(InputError, match=r"arm\.urdf cannot be read"):
        ArmModel(file, PANDA)
    file.write_text(URDF.read_text(), "utf-8")  # without its meshes
    with pytest.raises(InputError, match=r"link0\.obj"):
        ArmModel(file, PANDA)


def test_without_pinocchio_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(Package, "is_installed", property(lambda self: False))
    with pytest.raises(InputError, match=r"pip install 'treepilot\[arm\]'"):
        ArmModel(URDF, PANDA)
