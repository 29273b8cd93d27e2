"""A run that is recorded and replayed: the same observations and estimates, bit for bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from typer.testing import CliRunner

import missions
from missions.cli.app import app
from robots.replayed import ReplayedBody
from stack.body import BodyCommand
from stack.errors import BodyError, InputError
from stack.telemetry.event_log import read_events
from stack.telemetry.sensor_log import SensorLog, read_observations
from stack.types import (
    Battery,
    CameraModel,
    Image,
    Imu,
    Observation,
    Odometry,
    Pose2D,
    RangeReading,
    Scan,
    Twist,
)
from tests.stack.sim.sim_rover import ROVER

ROOT = Path(__file__).parents[2]
MISSION = """
mission: there
robot: scout
world: small_room
run:
  sequence:
    - navigate_to_pose: {goal: [5.0, 3.8, 0]}
    - spin: {angle: 90 deg}
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A run of a real mission with its sensor log."""
    folder = tmp_path_factory.mktemp("recorded")
    mission = folder / "there.yaml"
    mission.write_text(MISSION)
    report = missions.run(mission, seed=7, out=folder / "run", record=["sensors"])
    assert report.status == "success", report.reason
    return mission, folder / "run", report


def test_a_replay_has_the_same_estimates_bit_for_bit(recorded, tmp_path):
    mission, folder, report = recorded
    replay = missions.run(mission, replay=folder / "sensors.mcap", out=tmp_path / "replay")
    assert replay.seed == 7  # that of the recording
    assert replay.final_pose["estimate"] == report.final_pose["estimate"]
    assert (replay.final_pose["truth"], replay.collisions) == (None, None)
    before, after = (
        [event.fields for event in read_events(run / "events.jsonl") if event.kind == "pose"]
        for run in (folder, tmp_path / "replay")
    )
    assert len(before) >= 5
    assert after == before


def test_a_replay_may_use_other_parameters_and_ends_with_the_recording(recorded, tmp_path):
    mission, folder, _ = recorded
    longer = mission.with_name("longer.yaml")
    longer.write_text(MISSION + "    - wait: {time: 60 s}\n")
    report = missions.run(longer, replay=folder / "sensors.mcap")
    assert (report.status, report.reason) == ("interrupted", "the recording is over")


def test_a_recording_of_another_robot_is_refused(recorded):
    mission, folder, _ = recorded
    with pytest.raises(InputError, match="recorded with the robot 'scout', this mission has 'gli"):
        missions.run(mission, robot="glide", replay=folder / "sensors.mcap")


@pytest.mark.parametrize(("content", "words"), [(None, "cannot read"), (b"ranges", "not a sensor")])
def test_a_wrong_file_is_an_error_of_the_user(recorded, tmp_path, content, words):
    mission, _, _ = recorded
    file = tmp_path / "sensors.mcap"
    if content is not None:
        file.write_bytes(content)
    result = CliRunner().invoke(app, ["run", str(mission), "--headless", "--replay", str(file),
                                      "--out", str(tmp_path / "out")])  # fmt: skip
    assert result.exit_code == 2 or isinstance(result.exception, InputError)
    with pytest.raises(InputError, match=words):
        list(read_observations(file))


def test_a_recording_needs_a_folder(recorded):
    mission, _, _ = recorded
    with pytest.raises(InputError, match="`record` needs a run folder"):
        missions.run(mission, record=["sensors"])


def test_a_damaged_message_and_a_damaged_seed_are_named(recorded, tmp_path):
    mission, folder, _ = recorded
    log = tmp_path / "sensors.mcap"
    content = (folder / "sensors.mcap").read_bytes()
    log.write_bytes(
        content.replace(b"\xa4time", b"\xa4tame", 3).replace(b"\xa4tame", b"\xa4time", 2)
    )
    with pytest.raises(InputError, match=r"the message after 0 s is damaged: KeyError\('time'\)"):
        list(read_observations(log))
    writer = SensorLog(log, {"robot": "scout", "seed": "seven"})
    writer.close()
    with pytest.raises(InputError, match="the seed 'seven' in its metadata is not a number"):
        missions.run(mission, replay=log)


numbers = st.floats(allow_nan=False, width=64)
poses = st.builds(Pose2D, numbers, numbers, numbers)
stamps = st.floats(0.0, 1e5)
measurements = st.one_of(
    st.builds(
        Scan, stamps, arrays(np.float32, st.integers(1, 20)), numbers, numbers, numbers, numbers,
        poses, numbers, st.none() | arrays(np.float64, 5),
    ),
    st.builds(RangeReading, stamps, st.floats(), numbers, numbers, numbers, poses, st.text()),
    st.builds(Odometry, stamps, poses, st.builds(Twist, numbers, numbers, numbers)),
    st.builds(
        Imu, arrays(np.float64, 3, elements=stamps), arrays(np.float64, (3, 3)),
        arrays(np.float64, (3, 3)),
    ),
    st.builds(
        Image, stamps, arrays(np.uint8, (2, 3, 3)),
        st.builds(
            CameraModel, st.just(3), st.just(2), numbers, st.tuples(numbers, numbers, numbers),
            numbers, numbers, st.none() | numbers, st.none() | st.tuples(numbers, numbers),
            st.just(()) | st.tuples(*[numbers] * 5),
        ),
    ),
    st.builds(Battery, numbers, st.booleans(), numbers, stamps),
)  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(st.lists(st.dictionaries(st.from_regex("[a-z]{1,8}", fullmatch=True), measurements,
                                min_size=1, max_size=4), min_size=1, max_size=5))  # fmt: skip
def test_every_measurement_survives_bit_for_bit(tmp_path_factory, steps):
    """A channel has one type: that of the first measurement of its name."""
    kinds: dict[str, type] = {}
    observations = []
    for n, step in enumerate(steps):
        kept = {k: v for k, v in step.items() if kinds.setdefault(k, type(v)) is type(v)}
        if kept:
            observations.append(Observation(0.05 * n, kept))
    path = tmp_path_factory.mktemp("log") / "sensors.mcap"
    log = SensorLog(path, {})
    for observation in observations:
        log.write(observation)
    log.close()
    log.close()
    read = list(read_observations(path))
    assert [bits(o) for o in read] == [bits(o) for o in observations]


def bits(value):
    """A measurement as nested tuples, arrays as their bytes; NaN equals itself."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, Observation):
        return value.time, {name: bits(item) for name, item in value.measurements.items()}
    if isinstance(value, float):
        return value.hex()
    if hasattr(value, "__dataclass_fields__"):
        return type(value), tuple(bits(getattr(value, name)) for name in value.__dataclass_fields__)
    return tuple(map(bits, value)) if isinstance(value, tuple) else value


def test_a_replayed_body_plays_one_observation_a_period_and_ignores_commands():
    battery = Battery(0.5)
    observations = [Observation(0.05 * n, {"battery": replace(battery, charge=0.1 * n)})
                    for n in range(3)]  # fmt: skip
    body = ReplayedBody(ROVER, observations)
    seen = []
    while not body.has_ended:
        seen.append((body.time, body.sense().battery.charge))
        body.command(BodyCommand(Twist(1.0)))
        body.wait(0.05)
    assert seen == [(0.0, 0.0), (0.05, pytest.approx(0.1)), (0.1, pytest.approx(0.2))]
    with pytest.raises(BodyError, match="no observations"):
        ReplayedBody(ROVER, [])
