"""The first difference of two runs that matters to people."""

from types import SimpleNamespace

import pytest

from missions.inspection.page.difference import difference
from stack.telemetry.records import Event


def run(name, *events):
    return SimpleNamespace(name=name, events=tuple(
        Event(number, 0, time, "info", "", kind, text, fields)
        for number, (time, kind, text, fields) in enumerate(events)
    ))  # fmt: skip


def pose(time, x, charge=1.0):
    return time, "pose", "", {"x": x, "y": 0.0, "charge": charge}


DOOR = 1.7, "door", "the door gate closed", {}
PLAN = 2.0, "replan", "new plan", {}


@pytest.mark.parametrize(
    ("one", "other", "said"),
    [
        ([pose(1, 0.5), DOOR, PLAN], [pose(1, 0.5, 1 - 1e-12), PLAN],
         "the first difference that matters: a: the door gate closed (1.7 s), but b: new plan"),
        ([pose(1, 0.5), DOOR], [pose(1, 0.5, 1 - 1e-12), DOOR],
         "the same happens in both runs, and the poses agree within 0.01 m"),
        ([pose(1, 0.5), DOOR], [pose(1, 0.52), PLAN], "the poses differ by 0.02 m at 1.0 s"),
        ([DOOR], [DOOR, PLAN], "the first difference that matters: a ends, but b: new plan"),
        ([DOOR], [DOOR], "the two runs are equal, event by event"),
    ],
)  # fmt: skip
def test_it_is_an_event_or_a_pose_and_no_last_bit(one, other, said):
    assert difference(run("a", *one), run("b", *other)).startswith(said)
