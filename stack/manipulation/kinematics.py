"""Forward and inverse kinematics of an arm.

The inverse is found by damped least squares (Sugihara, IEEE T-RO 2011): each step solves

    (J Jᵀ + (½ eᵀe + 1e-6) I) y = e,    Δq = Jᵀ y,

with the error e (6,) of the tool's pose in the tool's frame and its Jacobian J (6, n). The damping
vanishes with the error, so that the last steps converge quadratically. Joints that a step drives
against their limit are held there for that step, and the others compensate. Where this ends in a
local minimum, it begins again at random positions.
"""

from __future__ import annotations

import numpy as np

from stack.manipulation.model import ArmModel
from stack.types import FloatArray

STEPS = 60
"""Of one search; more do not find more, new starts do."""

POSITION_TOLERANCE = 1e-5
"""Metres."""

ANGLE_TOLERANCE = 1e-4
"""Radians: 0.006 degrees."""

DAMPING = 1e-6
"""Least damping, so that singular poses stay solvable."""

LONGEST_STEP = 0.7
"""Radians of a joint in one step: beyond, the Jacobian says nothing."""

PATIENCE = 8
"""Steps within which the error must fall by a fifth; a search that stalls is given up."""

ALIKE = 0.05
"""Radians: solutions whose joints all differ by less are one."""


class ArmKinematics:
    """Poses of the tool for positions of the joints, and back."""

    def __init__(self, model: ArmModel) -> None:
        self.model = model
        self._pin = model.pin
        self._data = model.model.createData()
        self._from_root = np.linalg.inv(model.base)
        limits = model.description.limits
        self._lower, self._upper = limits.lower, limits.upper

    def forward(self, positions: FloatArray, link: str = "") -> FloatArray:
        """Return the pose (4, 4) of a link, or of the tool, in `base_link`.

        Args:
            positions: (n,) of the joints.
            link: its name; empty: the tool's.

        Raises:
            ValueError: the arm has no such link.
        """
        frame = self.model.model.getFrameId(link) if link else self.model.tool
        if frame >= self.model.model.nframes:
            raise ValueError(f"the arm has no link {link!r}")
        self._pin.framesForwardKinematics(
            self.model.model, self._data, self.model.configuration(positions)
        )
        pose: FloatArray = self._from_root @ self._data.oMf[frame].homogeneous
        return pose

    def jacobian(self, positions: FloatArray) -> FloatArray:
        """Return the Jacobian (6, n) of the tool: metres, then radians, along `base_link`'s axes.

        Args:
            positions: (n,) of the joints.
        """
        pin, robot = self._pin, self.model.model
        pin.computeJointJacobians(robot, self._data, self.model.configuration(positions))
        pin.updateFramePlacement(robot, self._data, self.model.tool)
        whole = pin.getFrameJacobian(
            robot, self._data, self.model.tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )[:, self.model.columns]
        turn = self._from_root[:3, :3]
        return np.vstack((turn @ whole[:3], turn @ whole[3:]))

    def ik(
        self,
        target: FloatArray,
        seed: FloatArray,
        generator: np.random.Generator,
        restarts: int = 20,
    ) -> FloatArray | None:
        """Return positions (n,) of the joints that bring the tool to a pose.

        The solution that is reached from the seed, which is near it; else the nearest to the seed
        of those found from random positions.

        Args:
            target: (4, 4) of the tool in `base_link`.
            seed: (n,) positions to begin with and to stay near.
            generator: of the random positions.
            restarts: searches from random positions at most.

        Returns:
            Positions within the limits, to 0.01 mm and 0.006 degrees; None: nothing was found.
        """
        found = self.near(target, seed)
        if found is not None:
            return found
        solutions = self.solutions(target, seed, generator, count=2, restarts=restarts)
        return solutions[0] if solutions else None

    def solutions(
        self,
        target: FloatArray,
        seed: FloatArray,
        generator: np.random.Generator,
        count: int = 6,
        restarts: int = 20,
    ) -> list[FloatArray]:
        """Return different solutions of `ik`, the nearest to the seed first.

        Args:
            target: (4, 4) of the tool in `base_link`.
            seed: (n,) positions.
            generator: of the random positions.
            count: of solutions at most.
            restarts: searches at most.
        """
        found: list[FloatArray] = []
        for attempt in range(restarts + 1):
            begin = seed if attempt == 0 else generator.uniform(self._lower, self._upper)
            solution = self.near(target, begin)
            if solution is not None and not any(
                np.abs(solution - other).max() < ALIKE for other in found
            ):
                found.append(solution)
            if len(found) == count:
                break
        return sorted(found, key=lambda positions: float(np.abs(positions - seed).max()))

    def between(self, first: FloatArray, second: FloatArray, share: float) -> FloatArray:
        """Return the pose (4, 4) at a share of the straight line between two, turning evenly."""
        pose = np.eye(4)
        pose[:3, 3] = first[:3, 3] + share * (second[:3, 3] - first[:3, 3])
        turn = self._pin.log3(first[:3, :3].T @ second[:3, :3])
        pose[:3, :3] = first[:3, :3] @ self._pin.exp3(share * turn)
        return pose

    def near(self, target: FloatArray, begin: FloatArray) -> FloatArray | None:
        """Return the solution to which one search converges; None if it does not.

        Args:
            target: (4, 4) of the tool in `base_link`.
            begin: (n,) positions from which it is searched.
        """
        pin, robot, data, tool = self._pin, self.model.model, self._data, self.model.tool
        goal = pin.SE3(self.model.base @ target)
        positions = np.clip(begin, self._lower, self._upper)
        least, since = np.inf, 0
        for _ in range(STEPS):
            pin.computeJointJacobians(robot, data, self.model.configuration(positions))
            pin.updateFramePlacement(robot, data, tool)
            error = pin.log6(data.oMf[tool].actInv(goal)).vector
            if (
                np.linalg.norm(error[:3]) < POSITION_TOLERANCE
                and np.linalg.norm(error[3:]) < ANGLE_TOLERANCE
            ):
                return positions
            size = float(np.linalg.norm(error))
            least, since = (size, 0) if size < 0.8 * least else (least, since + 1)
            if since > PATIENCE:
                return None
            jacobian = pin.getFrameJacobian(robot, data, tool, pin.ReferenceFrame.LOCAL)
            positions = self._stepped(positions, jacobian[:, self.model.columns], error)
        return None

    def _stepped(
        self, positions: FloatArray, jacobian: FloatArray, error: FloatArray
    ) -> FloatArray:
        """Return the positions after one step; joints at a limit do not take part."""
        damping = (0.5 * float(error @ error) + DAMPING) * np.eye(6)
        free = np.ones(len(positions))
        for _ in range(2):
            part = jacobian * free
            step = part.T @ np.linalg.solve(part @ part.T + damping, error)
            held = ((positions <= self._lower) & (step < 0.0)) | (
                (positions >= self._upper) & (step > 0.0)
            )
            if not held.any():
                break
            free[held] = 0.0
        step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        return np.clip(positions + step * free, self._lower, self._upper)
