"""Types of measurements that a package brings are observed, recorded and replayed."""

from dataclasses import dataclass

import numpy as np
import pytest

import missions
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.execution.running import run_in_turns
from robots.replayed import ReplayedBody
from robots.scripted import ScriptedBody
from stack.errors import BodyError, InputError
from stack.telemetry import record_types
from stack.telemetry.sensor_log import SensorLog, read_observations
from stack.types import Observation, Odometry

PLUGIN = """
from dataclasses import dataclass

from numpy.typing import NDArray
import numpy as np


@dataclass(frozen=True)
class Probe:
    name: str
    deviation: float | None = None


@dataclass(frozen=True)
class Temperatures:
    stamp: float
    degrees: NDArray[np.float32]
    probe: Probe
    limits: tuple[float, float] = (0.0, 80.0)


@dataclass(frozen=True)
class Timeless:
    degrees: float
"""

MISSION = """
mission: warm
format: 1
robot: scout
world: small_room
localisation: dead_reckoning
run: {wait: {time: 0.5 s}}
"""


@pytest.fixture
def warm(tmp_path, monkeypatch):
    """The module of an installed package that brings a type of measurements."""
    site = tmp_path / "site"
    (site / "warm-0.1.dist-info").mkdir(parents=True)
    (site / "warm_records.py").write_text(PLUGIN)
    (site / "warm-0.1.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: warm\nVersion: 0.1\n"
    )
    (site / "warm-0.1.dist-info" / "entry_points.txt").write_text(
        f"[{record_types.GROUP}]\nTemperatures = warm_records:Temperatures\n"
        "Timeless = warm_records:Timeless\nOther = warm_records:Temperatures\n"
        "Gone = warm_nothing:Gone\nWords = warm_records:__doc__\n"
    )
    monkeypatch.syspath_prepend(site)
    record_types._plugged.cache_clear()
    import warm_records

    yield warm_records
    record_types._plugged.cache_clear()


def measured(warm, time):
    degrees = np.array([20.0 + time, np.nan], dtype=np.float32)
    return warm.Temperatures(time, degrees, warm.Probe("motor", 0.5), (5.0, 60.0))


def same(one, other):
    assert type(one) is type(other)
    assert one.degrees.dtype == other.degrees.dtype
    assert one.degrees.tobytes() == other.degrees.tobytes()
    return (one.stamp, one.probe, one.limits) == (other.stamp, other.probe, other.limits)


def test_a_body_s_own_measurements_are_observed_recorded_and_replayed(warm, tmp_path):
    def make(setup):
        script = lambda time, pose: {"motor": measured(warm, time)}  # noqa: E731
        return ScriptedBody(setup.robot, script, start=setup.start)

    file = tmp_path / "warm.yaml"
    file.write_text(MISSION)
    options = RunOptions(out=tmp_path / "run", record=("sensors",), serve=False)
    run = Run(prepare(file, options), options, make_body=make)
    run_in_turns([run])
    state = run.engine.runtime.perceived
    assert same(state.newest("motor", warm.Temperatures), measured(warm, state.time))
    log = tmp_path / "run" / "sensors.mcap"
    found = [
        observation.named("motor", warm.Temperatures) for observation in read_observations(log)
    ]
    assert len(found) >= 10  # 0.5 s at 20 Hz
    assert all(same(item, measured(warm, item.stamp)) for item in found)
    replayed = ReplayedBody(run.engine.body.description, read_observations(log))
    assert same(replayed.sense().of(warm.Temperatures)["motor"], found[0])
    again = missions.run(file, replay=log, out=tmp_path / "again", record=("sensors",))
    assert again.reason == "" or "recording is over" in again.reason
    twice = next(read_observations(tmp_path / "again" / "sensors.mcap"))
    assert same(twice.named("motor", warm.Temperatures), found[0])


@dataclass(frozen=True)
class Humidity:
    stamp: float


@dataclass(frozen=True)
class Temperatures:
    stamp: float


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        (Humidity, "no type of measurements 'Humidity'; install"),
        (Temperatures, "warm_records have"),
    ],
)
def test_what_could_not_be_read_back_is_refused_when_it_is_recorded(warm, tmp_path, kind, sentence):
    log = SensorLog(tmp_path / "log.mcap", {})
    with pytest.raises(BodyError, match=f"the sensor wet cannot be recorded: .*{sentence}"):
        log.write(Observation(0.0, {"wet": kind(0.0)}))
    log.close()


def test_a_log_of_a_package_that_is_not_installed_says_so(warm, tmp_path, monkeypatch):
    log = SensorLog(file := tmp_path / "log.mcap", {})
    log.write(Observation(0.0, {"motor": measured(warm, 0.0)}))
    log.close()
    record_types._plugged.cache_clear()
    monkeypatch.setattr(record_types, "GROUP", "treepilot.nothing")
    with pytest.raises(InputError, match="no type of measurements 'Temperatures'; install"):
        list(read_observations(file))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Timeless", "no field `stamp: float`"), ("Other", "its class is called 'Temperatures'"),
        ("Gone", "No module named 'warm_nothing'"), ("Words", "cannot be used"),
    ],
)  # fmt: skip
def test_a_type_that_cannot_be_used_is_refused(warm, name, reason):
    with pytest.raises(InputError, match=reason):
        record_types.record_type(name)


def test_built_in_types_need_no_package():
    assert record_types.record_type("Odometry") is Odometry
