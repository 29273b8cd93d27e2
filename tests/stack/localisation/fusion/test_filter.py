"""The odometry filter against closed forms, and delayed measurements against ordered ones."""

from __future__ import annotations

from math import cos, inf, sin

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from stack.localisation.fusion import kernels
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.history import History
from stack.localisation.fusion.measurements import NewKeyframe, RelativePose, StateMeasurement
from stack.localisation.fusion.parameters import EkfParameters, SourceParameters
from stack.types import FloatArray, Odometry, Pose2D, Twist
from tests.observed import observed
from tests.stack.sim.sim_rover import ROVER

NOISE = np.array([2e-4, 2e-5, 2e-3, 5e-3, 2e-7, 1e-6, 4.0, 20.0, 0.3, 1e-10, 1.0])
PERIOD = 0.05


def started(scale: float = 0.01, bias: float = 0.02) -> History:
    covariance = np.zeros((kernels.SIZE, kernels.SIZE))
    covariance[kernels.BIAS, kernels.BIAS] = bias**2
    covariance[kernels.SCALE, kernels.SCALE] = scale**2
    return History(0.0, np.zeros(kernels.SIZE), covariance, NOISE, 10.0)


def motion(forward: float, turn: float = 0.0, rotation: float | None = None) -> FloatArray:
    """Input of a step of 50 ms; without a rotation there is no gyro."""
    has_gyro = float(rotation is not None)
    return np.array([PERIOD, forward, 0.0, turn, rotation or 0.0, 0.0, 0.0, has_gyro, 0.0])


def test_straight_ahead_the_filter_is_the_linear_kalman_filter():
    """Wheels with a wrong scale along x, a position at every fourth step.

    x' = x + (1 + k) d, Q = q |d|; z = x + N(0, R): the textbook filter with the state (x, k).
    """
    history, d, variance = started(), 0.04, 0.01**2
    x, k, p = 0.0, 0.0, np.diag([0.0, 0.01**2])
    for step in range(1, 41):
        history.move(motion(d, rotation=0.0), disturbed=False)
        change = np.array([[1.0, d], [0.0, 1.0]])
        x, p = x + (1.0 + k) * d, change @ p @ change.T + np.diag([NOISE[0] * d, 0.0])
        if step % 4 == 0:
            z = 1.02 * d * step
            history.add(
                StateMeasurement(step * PERIOD, "gps", (0,), np.array([z]), np.array([[variance]]))
            )
            gain = p[:, 0] / (p[0, 0] + variance)
            x, k = np.array([x, k]) + gain * (z - x)
            p = p - np.outer(gain, p[0])
    newest = history.newest
    state = newest.state[[0, kernels.SCALE]]
    assert state == pytest.approx([x, k], abs=1e-12)
    found = newest.covariance[np.ix_([0, kernels.SCALE], [0, kernels.SCALE])]
    assert found == pytest.approx(p, abs=1e-15)
    assert 0.005 < k < 0.02  # and part of the scale is learnt


@given(st.floats(-0.05, 0.05), st.floats(-0.1, 0.1))
@settings(deadline=None, max_examples=30)
def test_without_measurements_errors_grow_as_the_arcs_derivatives_say(forward, rotation):
    """The covariance after 20 steps equals that of finite differences of the closed form."""
    history = started(scale=0.02, bias=0.01)
    for _ in range(20):
        history.move(motion(forward, rotation, rotation), disturbed=False)

    def end(scale: float, bias: float) -> FloatArray:
        turn, ahead = 20 * (rotation - bias * PERIOD), 20 * (1.0 + scale) * forward
        a, b = 1.0 - turn**2 / 6.0, turn / 2.0
        if abs(turn) > 1e-4:
            a, b = sin(turn) / turn, (1.0 - cos(turn)) / turn
        return np.array([a * ahead, b * ahead, turn])

    derivative = np.column_stack([
        (end(1e-5, 0.0) - end(-1e-5, 0.0)) / 2e-5, (end(0.0, 1e-5) - end(0.0, -1e-5)) / 2e-5,
    ])  # fmt: skip
    systematic = derivative @ np.diag([0.02**2, 0.01**2]) @ derivative.T
    found = history.newest.covariance[:3, :3]
    random = found - systematic
    # what remains is the noise of the steps: at least that along the path, no negative part
    assert np.linalg.eigvalsh(random)[0] > -1e-7
    assert random[0, 0] + random[1, 1] < 20 * (NOISE[0] + NOISE[1]) * abs(forward) * 1.05 + 2e-6
    assert history.newest.state[:3] == pytest.approx(end(0.0, 0.0), abs=1e-9)


def kinds(stamp: float, number: int) -> list[StateMeasurement | RelativePose | NewKeyframe]:
    """A measurement of each kind; the values are plausible, and one is far beyond its gate."""
    wide = np.diag([4e-4, 4e-4, 1e-4])
    return [
        StateMeasurement(stamp, f"p{number}", (0, 1), np.array([stamp, 0.01]), wide[:2, :2], 4.0),
        StateMeasurement(stamp, f"t{number}", (3, 5), np.array([1.0, 0.1]), wide[:2, :2], 4.0),
        StateMeasurement(stamp, f"g{number}", (0,), np.array([50.0]), wide[:1, :1], 4.0),
        RelativePose(stamp, f"r{number}", np.array([stamp - 0.3, 0.0, 0.02]), wide, inf),
        NewKeyframe(stamp, f"k{number}"),
    ]


@given(
    # Stamps that differ at all differ by more than `TOLERANCE`, below which they are the same.
    st.lists(
        st.tuples(st.integers(10_000, 990_000).map(lambda n: 1e-6 * n), st.integers(0, 4)),
        min_size=1,
        max_size=8,
    ),
    st.randoms(use_true_random=False),
    st.booleans(),
)
@settings(deadline=None, max_examples=40)
def test_delayed_measurements_give_the_state_of_ordered_ones(chosen, random, gyro):
    """To the last bit, whatever the order of arrival; the same stamps are ordered by name."""
    steps = [motion(0.05, 0.004 * (n % 5), 0.003 if gyro else None) for n in range(20)]
    measured = [kinds(stamp, n)[kind] for n, (stamp, kind) in enumerate(chosen)]
    ordered, delayed = started(), started()
    waiting = sorted(measured, key=lambda item: (item.stamp, item.name))
    for step in steps:
        ordered.move(step, disturbed=False)
        delayed.move(step, disturbed=False)
        while waiting and waiting[0].stamp <= ordered.newest.key[0]:
            ordered.add(waiting.pop(0))
    shuffled = list(measured)
    random.shuffle(shuffled)
    for item in shuffled:
        delayed.add(item)
    assert np.array_equal(ordered.newest.state, delayed.newest.state)
    assert np.array_equal(ordered.newest.covariance, delayed.newest.covariance)


@given(st.lists(st.tuples(st.floats(0.0, 0.99), st.integers(0, 4)), max_size=8), st.integers(0, 19))
@example([(4.1e-09, 0)], 1)  # a step of 4 ns: eigenvalues from 1e-28 to 4.9e4
@settings(deadline=None, max_examples=40)
def test_the_covariance_stays_symmetric_and_positive(chosen, disturbed_from):
    """But for the rounding of LAPACK's eigenvalues: dimension, epsilon and the largest of them."""
    history = started()
    for n in range(20):
        history.move(motion(0.05, 0.01, 0.01), disturbed=n >= disturbed_from)
    for n, (stamp, kind) in enumerate(chosen):
        history.add(kinds(stamp, n)[kind])
    for node in history.nodes:
        assert np.array_equal(node.covariance, node.covariance.T)
        least, *_, largest = np.linalg.eigvalsh(node.covariance)
        assert least > -max(1e-12, node.covariance.shape[0] * np.finfo(float).eps * largest)


def test_a_measurement_ahead_of_the_motions_waits_and_one_too_old_is_not_used():
    history = started()
    history.configure(0.5)
    early = StateMeasurement(0.1, "gps", (0,), np.array([1.0]), np.array([[1e-6]]))
    assert history.add(early) is None
    for _ in range(40):
        history.move(motion(0.0, rotation=0.0), disturbed=False)
    assert history.add(early) is None  # 1.9 s ago, and the history covers 0.5 s
    assert history.newest.state[0] == pytest.approx(0.0, abs=1e-9)  # known exactly: no change
    assert len(history.nodes) < 14


def ekf(**source: object) -> EkfOdometry:
    entry = SourceParameters(sensor="flow", **source)  # type: ignore[arg-type]
    return EkfOdometry(EkfParameters(sources=(entry,)), ROVER)


def drive(fusion: EkfOdometry, measured, steps: int = 60, late: int = 0) -> Odometry:
    """Wheels say 0.5 m/s; `measured(stamp)` is what the source says, `late` steps later."""
    pending: list[Odometry] = []
    fused = Odometry(0.0, Pose2D(0.0, 0.0), Twist())
    for step in range(steps):
        now = PERIOD * step
        if measured(now) is not None:
            pending.append(measured(now))
        due = pending.pop(0) if len(pending) > late else None
        wheels = Odometry(now, Pose2D(0.5 * now, 0.0), Twist(0.5))
        fused = fusion.update(observed(now, wheels, flow=due))
    return fused


def flowing(now: float) -> Odometry:
    """2 % faster than the wheels, and a wild lateral speed."""
    return Odometry(now, Pose2D(0.51 * now, 3.0 * now), Twist(0.51, 0.0, 3.0))


def test_only_the_chosen_axes_of_a_source_count():
    fused = drive(ekf(twist=("linear",), speed_deviation=0.005), flowing)
    assert fused.pose.x == pytest.approx(0.51 * 2.95, abs=0.004)  # wheels alone: 1.475
    assert abs(fused.pose.y) < 1e-9


@pytest.mark.parametrize("late", [0, 3])
def test_a_late_source_counts_for_its_own_stamp(late):
    """Poses 150 ms old, with a frame of their own, give what poses without delay give."""
    source = {"pose": ("x",), "position_deviation": 0.002}
    fused = drive(ekf(**source), flowing, late=late)
    assert fused.pose.x == pytest.approx(0.51 * 2.95, abs=0.003)


def test_measurements_beyond_the_gate_are_ignored():
    def wild(now: float) -> Odometry:
        return Odometry(now, Pose2D(0.0, 0.0), Twist(5.0))

    fused = drive(ekf(twist=("linear",), speed_deviation=0.05, gate=3.0), wild)
    assert fused.pose.x == pytest.approx(0.5 * 2.95, abs=1e-9)


def test_after_its_timeout_a_source_is_aligned_again():
    """The source's frame jumps by 7 m while it is silent for 1 s."""

    def jumping(now: float) -> Odometry | None:
        if 1.0 < now < 2.0:
            return None
        shift = 7.0 if now >= 2.0 else 0.0
        return Odometry(now, Pose2D(0.5 * now + shift, 0.0), Twist(0.5))

    source = {"pose": ("x", "y", "heading"), "position_deviation": 0.01}
    fused = drive(ekf(timeout=0.5, **source), jumping)
    assert fused.pose.x == pytest.approx(0.5 * 2.95, abs=0.01)
    fused = drive(ekf(timeout=5.0, gate=1e9, **source), jumping)
    assert fused.pose.x > 2.0  # without the timeout the jump counts
