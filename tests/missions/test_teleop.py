"""An operator at the real telemetry client drives the simulated robot."""

from __future__ import annotations

import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from stack.telemetry.client import TelemetryClient
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Command, MissionState
from stack.telemetry.server import TelemetryServer

MISSION = """mission: by hand
format: 1
robot: scout
world: small_room
start: home
run:
  sequence:
    - wait: {time: 500 ms}
    - assisted_teleop: {time: 10 min}
    - wait: {time: 500 ms}
"""
STEPS = 2000
"""Control periods within which an answer comes, whatever the machine: they take milliseconds."""


class Station:
    """A run with a server, and an operator's client that talks to it between its steps."""

    def __init__(self, plan) -> None:
        self.server = TelemetryServer()
        info = run_info(plan, "by_hand", 0)
        self.telemetry = Telemetry(info, [self.server])
        self.events = []
        emit = self.telemetry.emit
        self.telemetry.emit = lambda *a, **k: self.events.append(emit(*a, **k))
        self.engine = build(plan, RunOptions(serve=False), self.telemetry, None)
        self.runtime = self.engine.runtime
        assert self.server.handle is not None
        self.client = TelemetryClient(self.server.handle)
        self._sent = 0
        self.snapshot = None

    def order(self, kind, **arguments):
        """Send a command and step until it is answered."""
        self._sent += 1
        self.client.send(Command(f"{self._sent}", kind, arguments))
        for _ in range(STEPS):
            self.runtime.step()
            self.snapshot = self.client.poll() or self.snapshot
            for ack in self.client.acks():
                if ack.id == f"{self._sent}":
                    return ack
        raise AssertionError(f"no answer to {kind}")

    def run(self, seconds):
        """Step for a time."""
        for _ in range(round(seconds / self.runtime.period)):
            self.runtime.step()

    def close(self):
        self.client.close()
        self.runtime.parts.navigator.close()
        self.telemetry.close(None)
        self.engine.body.close()


@pytest.fixture
def station(tmp_path):
    path = tmp_path / "by_hand.yaml"
    path.write_text(MISSION, "utf-8")
    station = Station(prepare(path, RunOptions(serve=False)))
    yield station
    station.close()


def test_velocities_are_refused_unless_the_mission_asks_for_them(station):
    station.run(0.1)
    refused = station.order("teleop", linear=0.3)
    assert (refused.done, refused.reason) == (
        False, "the mission drives: velocities are accepted only while assisted_teleop is running",
    )  # fmt: skip
    assert not station.order("teleop_done").done


def test_the_operator_drives_into_everything_and_touches_nothing(station):
    station.run(0.7)
    parts = station.runtime.parts
    assert station.order("teleop", linear=0.3).done
    before = parts.scorer.truth
    station.run(0.4)
    assert parts.scorer.truth.distance_to(before) > 0.05
    assert station.order("pause").done
    assert station.order("teleop", linear=0.3).reason == "the mission is paused"
    assert station.order("resume").done
    assert "linear: expected a finite number" in station.order("teleop", linear=float("nan")).reason
    for turn in (0.0, 0.3, -0.4):
        for _ in range(25):
            assert station.order("teleop", linear=0.8, angular=turn).done
            station.run(0.2)
    assert parts.scorer.counters()["collisions"] == 0
    assert parts.scorer.truth.distance_to(before) > 1.0
    assert station.snapshot.teleop
    assert station.order("teleop_done").done
    station.run(5.0)
    assert station.runtime.state is MissionState.SUCCESS, station.runtime.reason
    steered = [event for event in station.events if event.kind == "teleop"]
    assert len(steered) == 1 + 75
    assert steered[0].fields["arguments"] == {"linear": 0.3}
    assert [event.step for event in steered] == sorted({event.step for event in steered})


def test_nobody_at_the_keys_is_a_failure(station):
    station.run(35.0)
    assert station.runtime.state is MissionState.FAILURE
    assert "NO_PROGRESS the operator sent no velocity for 30 s" in station.runtime.reason


@pytest.mark.parametrize(
    ("hold", "go_on"), [("pause", ["resume"]), ("estop", ["release", "resume"])]
)
def test_what_was_ordered_before_a_stop_is_not_driven_after_it(station, hold, go_on):
    station.run(0.7)
    assert station.order("teleop", linear=0.3).done
    assert station.order(hold).done
    station.run(2.0)
    before = station.runtime.distance
    for kind in go_on:
        assert station.order(kind).done
    station.run(0.5)
    assert station.runtime.distance == pytest.approx(before, abs=0.005)
    assert station.order("teleop", linear=0.3).done  # and a new one is
    station.run(0.3)
    assert station.runtime.distance > before + 0.02
