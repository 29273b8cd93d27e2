"""Which pictures pass, which events they cause, and that nothing malformed ever passes."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from stack.perception.cameras.parameters import CameraParameters
from stack.perception.cameras.watch import CameraWatch
from stack.types import DepthImage, Image, Observation, Pose2D
from tests.stack.perception.cameras.pictures import (
    COLOUR,
    DEPTH,
    DEPTH_FAULTS,
    PIXEL_FAULTS,
    SCOUT,
    broken,
    colour_picture,
    floor_picture,
)

MADE = {"camera": colour_picture, "depth": floor_picture}
CASES = [(name, *case) for name in MADE for case in PIXEL_FAULTS.values()]
CASES += [("depth", *case) for case in DEPTH_FAULTS.values()]
IDS = [f"{name}, {fault}" for name in MADE for fault in PIXEL_FAULTS]
IDS += [f"depth, {fault}" for fault in DEPTH_FAULTS]


class Watched:
    """A camera that delivers every 0.1 s to a robot that drives 0.5 m/s."""

    def __init__(self, name, speed=0.5, **parameters):
        self.name, self.speed, self.now, self.number = name, speed, 0.0, 0
        self.watch = CameraWatch(SCOUT, CameraParameters(**parameters))
        self.events = []

    def good(self, stamp=None):
        self.number += 1
        return MADE[self.name](self.now + 0.1 if stamp is None else stamp, self.number)

    def see(self, picture=None, *, is_on=True):
        """Pass a picture on 0.1 s later; return it if it went through."""
        self.now = round(self.now + 0.1, 6)
        measured = {} if picture is None else {self.name: picture}
        at = Pose2D(self.speed * self.now, 0.0)
        requested = [self.name] if is_on else []
        passed, events = self.watch.update(Observation(self.now, measured), at, requested)
        self.events += events
        return passed.measurements.get(self.name)

    @property
    def state(self):
        return next(state for state in self.watch.states if state.name == self.name)

    @property
    def words(self):
        return [event.fault for event in self.events]


@pytest.mark.parametrize(("name", "change", "word"), CASES, ids=IDS)
def test_a_broken_picture_is_refused_with_one_event_and_good_ones_end_the_fault(name, change, word):
    seen = Watched(name)
    assert seen.see(seen.good()) is not None and seen.events == []
    for _ in range(4):
        assert seen.see(broken(seen.good(), change)) is None
    assert seen.words == [word]
    assert seen.state.fault == word and seen.state.age == pytest.approx(0.4)
    for _ in range(3):
        assert seen.see(seen.good()) is not None  # used at once
    assert seen.words == [word, ""] and seen.state.fault == ""
    assert seen.events[1].text == f"the camera {name} works again"


def test_the_event_says_what_came_and_what_was_expected():
    seen = Watched("depth")
    seen.see(broken(seen.good(), lambda depth: depth[:60]))
    seen.see(broken(seen.good(), lambda depth: np.full_like(depth, nan)))
    assert [event.text for event in seen.events] == [
        "the camera depth delivers pictures of 60 x 160 values; expected 120 x 160; it is ignored",
        "the camera depth measures distances of 0.15 to 4 m in 0.0% of its pixels; expected 5.0%;"
        " it is ignored",
    ]


def test_a_covered_colour_camera_is_reported_and_its_pictures_pass():
    seen = Watched("camera")
    black = broken(seen.good(), np.zeros_like)
    assert seen.see(black) is not None
    assert seen.events[0].text == (
        "the camera camera delivers pictures of one colour (0, 0, 0); it may be covered"
    )


@pytest.mark.parametrize("name", MADE)
def test_the_same_picture_again_and_again_is_frozen_only_while_the_robot_moves(name):
    standing, driving = Watched(name, speed=0.0), Watched(name)
    first = MADE[name](0.1)
    for seen in (standing, driving):
        passed = [seen.see(replace(first, stamp=seen.now + 0.1)) is not None for _ in range(20)]
        if seen is standing:
            assert all(passed) and seen.events == []
    # Five repeats after the first picture; the robot drives 5 cm in each 0.1 s.
    assert passed == [True] * 5 + [False] * 15
    assert driving.words == ["frozen"]
    driving.speed = 0.0  # the robot has stopped: the camera is frozen nevertheless
    driving.see(replace(first, stamp=driving.now + 0.1))
    assert driving.state.fault == "frozen"
    assert all(driving.see(driving.good()) is not None for _ in range(3))
    assert driving.words == ["frozen", ""]


def test_frozen_pictures_can_be_allowed():
    seen = Watched("depth", frozen_pictures=0)
    first = floor_picture(0.1)
    assert all(seen.see(replace(first, stamp=seen.now + 0.1)) is not None for _ in range(20))


def test_late_pictures_pass_with_a_warning_and_their_true_age():
    seen = Watched("depth")
    for _ in range(5):
        assert seen.see(seen.good(stamp=seen.now + 0.1 - 0.8)) is not None
    assert seen.words == ["late"]
    assert seen.state.age == pytest.approx(0.8)


def test_stamps_in_the_future_or_out_of_order_are_refused():
    seen = Watched("depth")
    assert seen.see(seen.good(stamp=9.0)) is None
    assert seen.see(seen.good(stamp=nan)) is None
    assert seen.see(seen.good(stamp=inf)) is None
    assert seen.see(seen.good()) is not None
    assert seen.see(seen.good(stamp=0.2)) is None
    assert seen.words == ["stamp"]


def test_silence_is_reported_while_pictures_are_requested_and_ends_with_a_picture():
    seen = Watched("depth")
    seen.see(seen.good())
    for _ in range(10):
        seen.see()
    assert seen.words == []  # silent for 1.0 s, which is allowed
    for _ in range(10):
        seen.see()
    assert seen.words == ["silent"]
    assert seen.events[0].text == (
        "the camera depth has delivered no picture for 1.10 s; expected 1 s at most"
    )
    for _ in range(3):
        seen.see(seen.good())
    assert seen.words == ["silent", ""]


def test_a_camera_that_is_off_is_not_silent():
    seen = Watched("camera")
    for _ in range(30):
        seen.see(is_on=False)
    assert seen.events == [] and not seen.state.is_on and seen.state.age == inf
    for _ in range(10):
        seen.see()  # switched on: it has a second
    assert seen.events == [] and seen.state.is_on


ANY_ARRAY = arrays.arrays(
    dtype=st.sampled_from([np.float32, np.float64, np.uint8, np.int16, np.bool_]),
    shape=st.one_of(
        arrays.array_shapes(max_dims=4, max_side=6), st.just((120, 160)), st.just((240, 320, 3))
    ),
    elements=None, fill=st.just(0),
)  # fmt: skip


@settings(deadline=None, max_examples=30)
@given(
    st.lists(
        st.tuples(st.sampled_from(["camera", "depth"]), ANY_ARRAY, st.floats(), st.booleans()),
        max_size=5,
    )
)
def test_whatever_a_body_delivers_only_well_formed_pictures_pass(pictures):
    watch = CameraWatch(SCOUT, CameraParameters())
    for number, (name, pixels, stamp, is_good) in enumerate(pictures):
        now = 0.1 * (number + 1)
        if is_good:
            picture = MADE[name](now, number)
        elif name == "camera":
            picture = Image(stamp, pixels, COLOUR.model)
        else:
            picture = DepthImage(stamp, pixels, DEPTH.model, DEPTH.range_min, DEPTH.range_max)
        passed, _ = watch.update(Observation(now, {name: picture}), Pose2D(now, 0.0), [name])
        found = passed.measurements.get(name)
        if is_good and all(not good for _, _, _, good in pictures[:number]):
            assert found is picture
        if isinstance(found, DepthImage):
            assert found.depth.shape == (120, 160) and found.depth.dtype == np.float32
            valid = (found.depth >= DEPTH.range_min) & (found.depth <= DEPTH.range_max)
            assert valid.mean() >= 0.05 and found.stamp <= now + 1e-6
        elif found is not None:
            assert found.pixels.shape == (240, 320, 3) and found.pixels.dtype == np.uint8
