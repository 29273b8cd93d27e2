"""Inverse kinematics beside PyBullet's: `python -m tests.benchmarks.arm_kinematics [POSES]`.

The poses are those of random positions within the limits: all can be reached. Both begin at the
home posture. A pose is solved if the tool is within 0.1 mm and 0.05 degrees, and the joints are
within their limits. PyBullet runs with the settings that it needs: 200 iterations down to 1e-6
with limits and a rest posture, as many without to refine the result, and up to 20 random positions
to begin from, as ours.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import process_time

import numpy as np
import pybullet

from stack.manipulation.kinematics import ArmKinematics
from stack.streams import stream
from stack.types import FloatArray
from tests.benchmarks.table import Rows, show
from tests.stack.manipulation.panda import HOME, LIMITS, URDF, panda

POSES = 1000
MILLIMETRES, DEGREES = 0.1, 0.05
RESTARTS = 20

Solver = Callable[[FloatArray, np.random.Generator], FloatArray | None]


class PyBullet:
    """PyBullet's inverse kinematics of the same arm."""

    def __init__(self) -> None:
        self.client = pybullet.connect(pybullet.DIRECT)
        self.arm = pybullet.loadURDF(str(URDF), useFixedBase=True, physicsClientId=self.client)
        joints = range(pybullet.getNumJoints(self.arm, physicsClientId=self.client))
        info = [pybullet.getJointInfo(self.arm, j, physicsClientId=self.client) for j in joints]
        self.joints = [entry[0] for entry in info if entry[1].startswith(b"panda_joint")][:7]
        (self.tool,) = (entry[0] for entry in info if entry[12] == b"panda_grasptarget")
        self.kinematics = ArmKinematics(panda())

    def solve(self, target: FloatArray, generator: np.random.Generator) -> FloatArray | None:
        """Return the first of up to 20 results that reach the pose; None without one."""
        for attempt in range(RESTARTS + 1):
            seed = HOME if attempt == 0 else generator.uniform(LIMITS.lower, LIMITS.upper)
            found = self.once(target, seed)
            if is_solution(self.kinematics, target, found):
                return found
        return None

    def once(self, target: FloatArray, seed: FloatArray) -> FloatArray:
        """Return the result with a rest posture, refined without it."""
        fingers = [0.04, 0.04]
        near_seed = self.calculated(
            target,
            seed,
            lowerLimits=[*LIMITS.lower, 0.0, 0.0],
            upperLimits=[*LIMITS.upper, *fingers],
            jointRanges=[*(LIMITS.upper - LIMITS.lower), *fingers],
            restPoses=[*seed, *fingers],
        )
        return self.calculated(target, near_seed)

    def calculated(
        self, target: FloatArray, begin: FloatArray, **posture: list[float]
    ) -> FloatArray:
        for joint, position in zip(self.joints, begin, strict=True):
            pybullet.resetJointState(self.arm, joint, position, physicsClientId=self.client)
        turn = panda().pin.Quaternion(target[:3, :3]).coeffs()
        found = pybullet.calculateInverseKinematics(
            self.arm,
            self.tool,
            target[:3, 3].tolist(),
            turn.tolist(),
            maxNumIterations=200,
            residualThreshold=1e-6,
            physicsClientId=self.client,
            **posture,
        )
        return np.array(found[:7])


def errors(kinematics: ArmKinematics, target: FloatArray, found: FloatArray) -> FloatArray:
    """Return the errors of a result: millimetres and degrees."""
    reached = kinematics.forward(found)
    turn = panda().pin.log3(target[:3, :3].T @ reached[:3, :3])
    way = reached[:3, 3] - target[:3, 3]
    return np.array([1000.0 * np.linalg.norm(way), np.rad2deg(np.linalg.norm(turn))])


def is_solution(kinematics: ArmKinematics, target: FloatArray, found: FloatArray) -> bool:
    """Return whether the positions reach the pose within the limits."""
    is_within = np.all(found >= LIMITS.lower) and np.all(found <= LIMITS.upper)
    return bool(is_within and np.all(errors(kinematics, target, found) < (MILLIMETRES, DEGREES)))


def row(name: str, solve: Solver, targets: list[FloatArray]) -> dict[str, float | str]:
    """Return the figures of a solver."""
    kinematics, times, found = ArmKinematics(panda()), [], []
    for number, target in enumerate(targets):
        begin = process_time()
        result = solve(target, stream(number, "ik"))
        times.append(1000.0 * (process_time() - begin))
        if result is not None and is_solution(kinematics, target, result):
            found.append(errors(kinematics, target, result))
    worst = np.max(found, axis=0) if found else (np.nan, np.nan)
    return {
        "solver": name,
        "solved_%": 100.0 * len(found) / len(targets),
        "worst_mm": round(float(worst[0]), 4),
        "worst_deg": round(float(worst[1]), 4),
        "median_ms": round(float(np.median(times)), 2),
        "p95_ms": round(float(np.percentile(times, 95)), 2),
    }


def run(count: int = POSES) -> Rows:
    """Return a row for each solver."""
    kinematics, generator = ArmKinematics(panda()), stream(0, "reachable poses")
    targets = [
        kinematics.forward(generator.uniform(LIMITS.lower, LIMITS.upper)) for _ in range(count)
    ]
    bullet = PyBullet()
    try:
        return [
            row("treepilot", lambda pose, draw: kinematics.ik(pose, HOME, draw), targets),
            row("PyBullet", bullet.solve, targets),
        ]
    finally:
        pybullet.disconnect(bullet.client)


if __name__ == "__main__":
    show("Inverse kinematics", run(int(sys.argv[1]) if len(sys.argv) > 1 else POSES))
