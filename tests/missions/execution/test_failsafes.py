"""Failsafes: each real condition, what the robot does about it, and how soon."""

from __future__ import annotations

from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from robots.scripted import ScriptedBody, scans_of
from stack.body import CLOCK, FAST_LOOP, LINK, MOTOR, PILOT, BodyHealth
from stack.errors import ParameterError
from stack.parameters import build
from stack.runtime.failsafe_parameters import ACTIONS, FailsafeParameters
from stack.runtime.failsafes import FailsafeInput, Failsafes
from stack.telemetry.records import MissionState
from stack.types import Battery, Imu
from tests.missions.execution.live_run import HEAD, PERIOD, LiveRun

BEGIN = 1.0
"""Time at which something goes wrong, s."""

DRIVE = "run: {drive_on_heading: {distance: 3 m, speed: 0.3}}\n"


class Faulty(ScriptedBody):
    """A body with one fault from BEGIN on: of BodyHealth, or one of the words below."""

    def __init__(self, setup, fault, *, real_time=False):
        self.fault, self._is_real_time = fault, real_time
        measure = scans_of(setup.robot, setup.world)

        def script(time, pose):
            turn = np.array([[0.0, 0.0, self._twist.angular]])
            stamps = np.array([time - 0.01, time])
            turns, rest = np.repeat(turn, 2, axis=0), np.array([[0.0, 0.0, 9.81]] * 2)
            found = {"imu": Imu(stamps, turns, rest), **measure(time, pose)}
            if self.is_on and fault == "blind":
                found.pop("lidar", None)
            if self.is_on and fault in ("low", "empty"):
                found["battery"] = Battery(0.15 if fault == "low" else 0.04, stamp=time)
            return found

        super().__init__(setup.robot, script, start=setup.start)

    @property
    def is_on(self):
        return self.time >= BEGIN - 1e-9

    @property
    def is_real_time(self):
        return self._is_real_time

    @property
    def health(self):
        of_body = self.is_on and self.fault in (LINK, MOTOR, PILOT, CLOCK, FAST_LOOP)
        return BodyHealth("it says why", self.fault) if of_body else BodyHealth()


@pytest.fixture
def live(tmp_path, live_run):
    numbers = count()

    def start(fault: str, settings: str = "", text: str = DRIVE, **more) -> LiveRun:
        head = HEAD + (f"navigation: {{failsafe: {{{settings}}}}}\n" if settings else "")
        folder = tmp_path / f"m{next(numbers)}"
        return live_run(folder, text, head, make_body=lambda setup: Faulty(setup, fault, **more))

    return start


@pytest.mark.parametrize(
    ("fault", "settings", "condition", "after", "state"),
    [
        *[(name, "", name, 0.0, "paused") for name in (LINK, MOTOR, PILOT, CLOCK, FAST_LOOP)],
        (MOTOR, "motor: stop", "motor", 0.0, "emergency stop"),
        (MOTOR, "motor: abort", "motor", 0.0, "aborted"),
        ("low", "", "low_battery", 0.0, "running"),
        ("low", "low_battery: pause", "low_battery", 0.0, "paused"),
        ("empty", "", "critical_battery", 0.0, "aborted"),
        ("empty", "critical_battery: stop", "critical_battery", 0.0, "emergency stop"),
        # the last scan came at 0.9 s, silence counts from there and is noticed after 1 s
        ("blind", "silent_sensor: pause", "silent_sensor", 1.9, "paused"),
        ("", "fence: [[0, 0], [1.4, 0], [1.4, 4], [0, 4]]", "geofence", None, "emergency stop"),
    ],
)
def test_the_robot_reacts_to_what_goes_wrong(live, fault, settings, condition, after, state):
    run = live(fault, settings)
    event = run.until("failsafe", within=200)
    assert event.fields["condition"] == condition
    if after is not None:
        assert event.time == pytest.approx(BEGIN + after, abs=2.5 * PERIOD)
    assert str(run.runtime.state) == state
    place = run.engine.body.pose
    run.steps(20)  # from 0.3 m/s at 1.5 m/s² within 0.2 s: 3 cm, and one period
    stands = run.engine.body.pose.distance_to(place) < 0.05
    assert stands == (state != "running") or run.speed == 0.0
    assert len(run.texts("failsafe")) == 1, "once each time"


def test_what_is_set_to_none_changes_nothing(live):
    run = live("low", "low_battery: none")
    run.steps(60)
    assert run.texts("failsafe") == []
    assert run.runtime.state is MissionState.RUNNING


def test_home_drives_to_where_the_run_began_and_stays_there(live):
    run = live("low", "low_battery: home")
    start = run.engine.body.pose
    run.until("failsafe", within=200)
    away = run.engine.body.pose.distance_to(start)
    assert away > 0.15
    assert run.until("detour", within=1000).fields["status"] == "success"
    assert run.engine.body.pose.distance_to(start) < 0.15
    assert run.runtime.state is MissionState.PAUSED
    assert run.runtime.reason == "the battery is low: 15%"


def test_the_end_of_a_condition_is_told_and_it_may_come_again(live):
    run = live(LINK)
    run.until("failsafe", within=200)
    run.engine.body.fault = ""
    assert run.until("failsafe_end").fields["condition"] == "link"
    assert run.runtime.state is MissionState.PAUSED, "nothing moves by itself"
    assert run.order("resume").done
    run.engine.body.fault = LINK
    assert run.until("failsafe").fields["action"] == "pause"


def test_an_operator_who_falls_silent_is_noticed_and_one_who_leaves_is_not(live):
    run = live("", "operator: pause")
    silent = iter([None] * 5 + [1.0] * 5 + [6.0] * 100)
    run.kept.silence = lambda: next(silent)
    event = run.until("failsafe", within=20)
    assert event.fields["condition"] == "operator"
    run.kept.silence = lambda: None
    assert run.until("failsafe_end").fields["condition"] == "operator"


def test_late_steps_of_a_real_robot_are_a_fault_and_of_a_simulation_not(live):
    for real_time in (True, False):
        run = live("", "late: pause, late_share: 0.5", real_time=real_time)
        run.steps(5)
        stages = run.runtime.stages
        stages.stage("step").recent.extend([2.0 * stages.budget] * 100)
        run.steps(3)
        assert bool(run.texts("failsafe")) is real_time


def told(inputs, **settings):
    """The events of failsafes that get an input in each step of 0.1 s."""
    events = []
    failsafes = Failsafes(
        build(FailsafeParameters, settings), lambda kind, text, **_: events.append(kind)
    )
    for number, (charge, late) in enumerate(inputs):
        perceived = SimpleNamespace(
            time=0.1 * number, battery=Battery(charge), estimate=SimpleNamespace(is_lost=False)
        )
        failsafes.update(FailsafeInput(perceived, BodyHealth(), {}, late_share=late))
    return events


def test_bursts_of_late_steps_are_one_fault_until_it_is_quiet_for_ten_seconds():
    bursts = [0.3 if number // 10 % 4 == 0 else 0.0 for number in range(600)]  # 1 s in every 4
    assert told((1.0, late) for late in bursts) == ["failsafe"]
    assert told((1.0, late) for late in [*bursts, *[0.0] * 101]) == ["failsafe", "failsafe_end"]
    around = [0.2 + (0.05 if number % 2 else -0.05) for number in range(600)]
    assert told((1.0, late) for late in around) == ["failsafe"]
    assert told((1.0, 0.15) for _ in range(600)) == []


def test_a_battery_whose_voltage_rises_without_load_is_low_once():
    sags = [0.19 if number % 20 < 10 else 0.23 for number in range(200)]
    assert told((charge, 0.0) for charge in sags) == ["failsafe"]
    assert told((charge, 0.0) for charge in [*sags, 0.26]) == ["failsafe", "failsafe_end"]


def test_a_fault_of_the_robot_itself_always_holds_it():
    for action in ("none", "warn", "home"):
        with pytest.raises(ParameterError, match=r"pause.*stop.*abort"):
            build(FailsafeParameters, {"pilot": action})
    lost = {build(FailsafeParameters, {"lost": action}).lost for action in ACTIONS}
    assert lost == set(ACTIONS)


@pytest.mark.parametrize(
    ("fence", "said"),
    [([[0, 0], [1, 1]], "at least three"), ([[0, 0, 0]] * 3, "a corner is"), ([1, 2, 3], "corner")],
)
def test_a_fence_that_is_none_is_refused(fence, said):
    with pytest.raises(ParameterError, match=said):
        FailsafeParameters(fence=tuple(fence))
