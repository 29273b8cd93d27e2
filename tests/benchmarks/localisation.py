"""Measure the particle filter on generated places: `python -m tests.benchmarks.localisation WHAT`.

WHAT: error (drives among people), pushes, kidnaps, time (of the sensor model and of an update), fit
(the weights of the health, to copy into stack/localisation/health_model.py) or reliability (of the
health, on other worlds than those of the fit).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from stack.localisation import health_model
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.types import Pose2D, wrap_angle
from tests.benchmarks.localisation_worlds import AMBIGUOUS, KINDS, Wanderer, place
from tests.stack.localisation.drawn_office import office
from tests.stack.navigation.toy_world import robot

FIT_SEEDS, TEST_SEEDS = 200, 400
"""First seeds of the worlds on which the health is fitted and tested."""

WATCHED = 15.0
"""Seconds after a push or kidnap."""


class Drive:
    """A filter on a wandering robot."""

    def __init__(self, kind: str, seed: int, people: int = 3, crowd: int = 0) -> None:
        self.generator = np.random.default_rng([seed, people, crowd])
        ground = place(kind, seed)
        self.robot = Wanderer(ground, self.generator, people, crowd)
        self.filter = Localiser(LocaliserParameters(), robot(), ground.grid, seed)
        self.filter.process(self.robot.odometry.pose, None)
        self.place_at(self.robot.pose)

    def place_at(self, pose: Pose2D) -> None:
        """Tell the filter where the robot is."""
        self.filter.set_pose(pose, 0.1, 0.05)

    def run(self, seconds: float) -> Iterator[float]:
        """Drive; yield the time after each scan."""
        for _ in range(round(seconds * 10)):
            scan = self.robot.step()
            self.filter.process(self.robot.odometry.pose, scan)
            yield self.robot.time

    @property
    def error(self) -> float:
        """Error of the position, metres."""
        return self.filter.estimate.pose.distance_to(self.robot.pose)

    @property
    def turned(self) -> float:
        """Error of the heading, radians."""
        return abs(wrap_angle(self.filter.estimate.pose.heading - self.robot.pose.heading))

    @property
    def is_right(self) -> bool:
        """Whether the estimate is as near as the health states."""
        near = self.error <= health_model.RIGHT_DISTANCE
        return near and self.turned <= health_model.RIGHT_ANGLE


@dataclass(frozen=True)
class Disturbance:
    """What became of a push or kidnap; seconds, None: not within WATCHED."""

    noticed: float | None
    healed: float | None


def errors(worlds: int) -> None:
    """Print errors and false alarms of drives."""
    for kind in KINDS:
        for crowd in (0, 6):
            off, turned, low = [], [], []
            for seed in range(worlds):
                drive = Drive(kind, seed, crowd=crowd)
                for _ in drive.run(60.0):
                    off.append(drive.error)
                    turned.append(drive.turned)
                    low.append(drive.filter.estimate.health < 0.3)
            print(
                f"{kind}, {crowd} people around: error {np.mean(off):.3f} m, 99 % "
                f"{np.quantile(off, 0.99):.3f} m, worst {max(off):.3f} m, "
                f"{np.degrees(np.mean(turned)):.2f} deg; LOST {np.mean(low):.2%}",
                flush=True,
            )


def disturbances(what: str, worlds: int, first: int = 100) -> list[Disturbance]:
    """Push or kidnap robots five times in each world; half of them stand afterwards."""
    results = []
    for kind in KINDS:
        for seed in range(first, first + worlds):
            drive = Drive(kind, seed, people=2)
            for _ in range(5):
                for _ in drive.run(6.0):
                    pass
                _disturb(drive, what)
                results.append(_watched(drive))
                if results[-1].healed is None:
                    drive.place_at(drive.robot.pose)
    return results


def _disturb(drive: Drive, what: str) -> None:
    if what == "push":
        drive.robot.push(
            float(drive.generator.uniform(0.1, 2.0)), float(drive.generator.uniform(-pi, pi) / 3)
        )
    else:
        drive.robot.kidnap()
    drive.robot.still = 30.0 if drive.generator.random() < 0.5 else 0.0


def _watched(drive: Drive) -> Disturbance:
    begin, noticed, healed = drive.robot.time, None, None
    for now in drive.run(WATCHED):
        estimate, near = drive.filter.estimate, drive.error < 0.1
        if noticed is None and (near or estimate.health < 0.5 or estimate.rivals):
            noticed = now - begin
        healed = (now - begin if healed is None else healed) if near else None
    drive.robot.still = 0.0
    return Disturbance(noticed, healed)


def print_disturbances(what: str, worlds: int) -> None:
    """Print how many were noticed and healed."""
    results = disturbances(what, worlds)
    noticed = [r.noticed for r in results if r.noticed is not None and r.noticed <= 3.0]
    healed = [r.healed for r in results if r.healed is not None]
    print(
        f"{what}: {len(results)}; noticed in 3 s {len(noticed)}, within 10 cm in {WATCHED:g} s "
        f"{len(healed)}, median {np.median(healed):.1f} s, 90 % {np.quantile(healed, 0.9):.1f} s"
    )


def samples(first: int, worlds: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features (n, k), factors (n, 2) and whether the pose was right (n,), twice a second.

    The factors are the share among rivals and the probability by the stated deviation.
    """
    rows, factors, right = [], [], []
    for kind in (*KINDS, *AMBIGUOUS):
        for seed in range(first, first + worlds):
            for crowd in (0, 4, 8):
                drive = Drive(kind, seed, people=3, crowd=crowd)
                for _ in _episodes(drive):
                    features = drive.filter.health_features
                    if features is not None and round(drive.robot.time * 10) % 5 == 0:
                        rows.append(features.row())
                        factors.append((features.share, features.within))
                        right.append(drive.is_right)
    return np.array(rows), np.array(factors), np.array(right)


def _episodes(drive: Drive) -> Iterator[None]:
    """Drive, with pushes, kidnaps and wrong poses set."""
    for episode in range(8):
        for _ in drive.run(6.0):
            yield
        kind = episode % 4
        if kind == 0:
            _disturb(drive, "push")
        elif kind == 1:
            _disturb(drive, "kidnap")
        elif kind == 2:
            off = drive.generator.normal(0.0, [0.4, 0.4, 0.2])
            drive.place_at(drive.robot.pose.compose(Pose2D(*map(float, off))))
        for _ in drive.run(4.0):
            yield
        drive.robot.still = 0.0
        if not drive.is_right and drive.generator.random() < 0.7:
            drive.place_at(drive.robot.pose)


def fitted(rows: np.ndarray, factors: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the weights of the logistic model by Fisher scoring, with a weak prior."""
    use = factors[:, 0] > 0.95  # the samples that rivals do not decide
    x, within, y = rows[use], factors[use, 1], right[use].astype(np.float64)
    weights = np.zeros(x.shape[1])
    for _ in range(100):
        logistic = 1.0 / (1.0 + np.exp(-np.clip(x @ weights, -30.0, 30.0)))
        p = np.clip(within * logistic, 1e-9, 1.0 - 1e-9)
        slope = within * logistic * (1.0 - logistic)
        gradient = x.T @ ((y - p) / (p * (1.0 - p)) * slope) - 0.1 * weights
        information = slope * slope / (p * (1.0 - p))
        curvature = (x * information[:, None]).T @ x + 0.1 * np.eye(x.shape[1])
        step = np.linalg.solve(curvature, gradient)
        weights = weights + step / max(1.0, np.abs(step).max())
        if np.abs(step).max() < 1e-8:
            break
    return weights


def reliability(
    rows: np.ndarray, factors: np.ndarray, right: np.ndarray, weights: np.ndarray
) -> tuple[float, list[tuple[int, float, float]]]:
    """Return the expected calibration error, and (samples, mean health, share right) of ten bins.

    M. P. Naeini, G. F. Cooper, M. Hauskrecht, "Obtaining Well Calibrated Probabilities Using
    Bayesian Binning", AAAI 2015.
    """
    stated = factors.prod(axis=1) / (1.0 + np.exp(-np.clip(rows @ weights, -30.0, 30.0)))
    which = np.minimum((stated * 10).astype(int), 9)
    table, error = [], 0.0
    for one in range(10):
        inside = which == one
        if inside.any():
            mean, true = float(stated[inside].mean()), float(right[inside].mean())
            table.append((int(inside.sum()), mean, true))
            error += inside.mean() * abs(mean - true)
    return float(error), table


def print_reliability(first: int, worlds: int, *, fit: bool) -> None:
    """Fit the weights, or test those in use."""
    rows, factors, right = samples(first, worlds)
    weights = fitted(rows, factors, right) if fit else health_model.WEIGHTS
    if fit:
        print("WEIGHTS =", np.array2string(weights, precision=3, separator=", "))
    error, table = reliability(rows, factors, right, weights)
    print(f"{right.size} samples, {right.mean():.1%} right, calibration error {error:.4f}")
    for count, stated, true in table:
        print(f"  {count:6d} samples: health {stated:.2f}, right {true:.2f}")


def times() -> None:
    """Print the time of the sensor model and of a whole update, 2000 particles, 60 beams."""
    ground, generator = office(), np.random.default_rng(0)
    parameters = replace(LocaliserParameters(), min_particles=2000, max_particles=2000)
    localiser = Localiser(parameters, robot(), ground.grid, 0)
    pose, odometry = Pose2D(5.75, 4.5, 0.3), Pose2D(0.0, 0.0)
    localiser.process(odometry, None)
    localiser.set_pose(pose, 0.03, 0.03)
    spent = []
    for step in range(200):
        scan = ground.scan(pose, 0.1 * step, generator)
        begin = time.perf_counter()
        localiser.process(odometry, scan)
        spent.append(time.perf_counter() - begin)
        turn = Pose2D(0.0, 0.0, 0.06)
        pose, odometry = pose.compose(turn), odometry.compose(turn)
    model = localiser._filter.beams
    points, particles = model.points(pose, scan, skip=False), localiser.particles
    single = []
    for _ in range(200):
        begin = time.perf_counter()
        model.log_likelihoods(particles, points)
        single.append(time.perf_counter() - begin)
    for name, values in (("sensor model", single), ("update", spent[20:])):
        print(f"{name}: median {1e3 * np.median(values):.3f} ms, least {1e3 * min(values):.3f} ms")


def main() -> None:
    """Run one measurement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "what", choices=["error", "pushes", "kidnaps", "time", "fit", "reliability"]
    )
    parser.add_argument("--worlds", type=int, default=7, help="worlds of each kind")
    given = parser.parse_args()
    run = {
        "error": lambda: errors(given.worlds),
        "pushes": lambda: print_disturbances("push", given.worlds),
        "kidnaps": lambda: print_disturbances("kidnap", given.worlds),
        "time": times,
        "fit": lambda: print_reliability(FIT_SEEDS, given.worlds, fit=True),
        "reliability": lambda: print_reliability(TEST_SEEDS, given.worlds, fit=False),
    }
    run[given.what]()


if __name__ == "__main__":
    main()
