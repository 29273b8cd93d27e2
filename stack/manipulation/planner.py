"""Collision-free paths of an arm: to positions or poses, and along straight lines of the tool.

A path is searched by RRT-Connect (rrt_connect.py) and then shortened: random points of it are
connected directly where that is free, and waypoints are left out. The same arguments and the same
state of the generator give the same path. The limit is a count of samples, never a time.

All motions keep `CLEARANCE` to objects. Where the start or the goal is nearer (the gripper at a
block, the hand above a table), the whole path keeps that smaller distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from stack.errors import NavigationError
from stack.manipulation.collisions import Collisions
from stack.manipulation.kinematics import ArmKinematics
from stack.manipulation.model import ArmModel
from stack.manipulation.rrt_connect import Space, rrt_connect
from stack.manipulation.scene import Scene
from stack.manipulation.timing import timed
from stack.types import FailureCode, FloatArray
from stack.types.arms import JointTrajectory

CLEARANCE = 0.01
"""Metres kept to objects: more than the errors of calibration and tracking."""

SMALLEST = 0.001
"""Metres: an arm that is nearer to an object touches it."""

ITERATIONS = 10_000
"""Samples of a search."""

COARSE = 6.0
"""Steps of a search are longer by this factor. The bound on the motion between two checks assumes
a stretched arm that turns all joints the same way; the true motion is a quarter of it (median) and
half of it in 99 of 100 steps of the Panda. The result is checked with the bound."""

SHORTCUTS = 60
"""Attempts to shorten a path."""

LINE_STEP = 0.01
"""Metres of the tool between two waypoints of a straight line."""

LINE_TURN = 0.05
"""Radians of the tool between two of them."""

LARGEST_JUMP = 0.35
"""Radians of a joint between two of them: beyond, the arm changes its posture."""


class ArmBlocked(NavigationError):
    """The arm touches something.

    Attributes:
        contact: what touches what: `panda_hand touches table`.
    """

    def __init__(self, code: FailureCode, where: str, contact: str) -> None:
        super().__init__(code, f"{where}: {contact}")
        self.contact = contact


class ArmPlanner:
    """Plans paths of an arm."""

    def __init__(self, model: ArmModel, clearance: float = CLEARANCE) -> None:
        self.model, self.clearance = model, clearance
        self.kinematics = ArmKinematics(model)

    def plan(
        self,
        start: FloatArray,
        goals: Sequence[FloatArray],
        scene: Scene,
        generator: np.random.Generator,
        iterations: int = ITERATIONS,
    ) -> FloatArray:
        """Return waypoints (k, n) from the start to one of the goals.

        Args:
            start: (n,) positions of the joints.
            goals: (n,) positions.
            scene: what must not be touched.
            generator: of the samples.
            iterations: samples at most.

        Raises:
            NavigationError: START_OCCUPIED or GOAL_OCCUPIED with the names of what touches,
                UNREACHABLE for goals beyond the limits, NO_MOTION_PLAN if nothing was found.
        """
        checks = self._checks(start, goals, scene)
        free = [goal for goal in goals if self._is_within(goal) and not checks.collides(goal)]
        for goal in sorted(free, key=lambda goal: float(np.abs(goal - start).max())):
            if checks.is_free(start, goal):
                return np.array([start, goal])
        path = self._search(start, free, checks, (generator, iterations))
        if path is None:
            raise NavigationError(
                FailureCode.NO_MOTION_PLAN,
                f"no path of the arm was found with {iterations} samples",
            )
        return shortened(path, checks, generator)

    def plan_to_pose(
        self,
        start: FloatArray,
        target: FloatArray,
        scene: Scene,
        generator: np.random.Generator,
        iterations: int = ITERATIONS,
    ) -> FloatArray:
        """Return waypoints (k, n) to any positions that bring the tool to a pose.

        Args:
            start: (n,) positions of the joints.
            target: (4, 4) of the tool in `base_link`.
            scene: what must not be touched.
            generator: of the samples.
            iterations: samples at most.

        Raises:
            NavigationError: as of `plan`; UNREACHABLE if the arm cannot reach the pose.
        """
        goals = self.kinematics.solutions(target, start, generator)
        if not goals:
            raise NavigationError(
                FailureCode.UNREACHABLE, f"the arm cannot reach {place_of(target)} with this turn"
            )
        return self.plan(start, goals, scene, generator, iterations)

    def straight(self, start: FloatArray, target: FloatArray, scene: Scene) -> FloatArray:
        """Return waypoints (k, n) that move the tool along a straight line to a pose.

        Args:
            start: (n,) positions of the joints.
            target: (4, 4) of the tool in `base_link`.
            scene: what must not be touched.

        Raises:
            NavigationError: START_OCCUPIED; UNREACHABLE if a part of the line cannot be reached
                without a change of posture; NO_MOTION_PLAN if something is in the way.
        """
        begin = self.kinematics.forward(start)
        way = float(np.linalg.norm(target[:3, 3] - begin[:3, 3]))
        turn = _angle_between(begin, target)
        count = max(1, int(np.ceil(max(way / LINE_STEP, turn / LINE_TURN))))
        waypoints = [start]
        for part in range(1, count + 1):
            pose = self.kinematics.between(begin, target, part / count)
            found = self.kinematics.near(pose, waypoints[-1])
            if found is None or np.abs(found - waypoints[-1]).max() > LARGEST_JUMP:
                raise NavigationError(
                    FailureCode.UNREACHABLE,
                    f"the arm cannot follow the line to {place_of(target)} beyond "
                    f"{100 * (part - 1) // count} % of it in this posture",
                )
            waypoints.append(found)
        checks = self._checks(start, waypoints[-1:], scene)
        for part in range(1, count + 1):
            if contact := checks.contact_between(waypoints[part - 1], waypoints[part]):
                where = (
                    f"the line to {place_of(target)} is blocked after "
                    f"{100 * (part - 1) // count} % of it"
                )
                raise ArmBlocked(FailureCode.NO_MOTION_PLAN, where, contact)
        return np.array(waypoints)

    def trajectory(
        self, waypoints: FloatArray, scene: Scene, speed: float = 1.0
    ) -> JointTrajectory:
        """Return the fastest free motion along a planned path (timing.py).

        Args:
            waypoints: (k, n) of a path that was planned in the scene.
            scene: what must not be touched; objects with a velocity move.
            speed: share of the joints' velocities and accelerations, above 0 and up to 1.

        Raises:
            NavigationError: COLLISION_AHEAD if an object moves into the way.
        """
        checks = self._checks(waypoints[0], [waypoints[-1]], scene)
        limits = self.model.description.limits
        slower = replace(
            limits, velocity=speed * limits.velocity, acceleration=speed * limits.acceleration
        )
        return timed(waypoints, slower, checks)[0]

    def _search(
        self,
        start: FloatArray,
        goals: Sequence[FloatArray],
        checks: Collisions,
        effort: tuple[np.random.Generator, int],
    ) -> FloatArray | None:
        """Search with coarse checks; if a part of the result touches something, with fine ones."""
        limits = self.model.description.limits
        for stride in (COARSE, 1.0):
            space = Space(limits.lower, limits.upper, partial(checks.is_free, stride=stride))
            path = rrt_connect(start, goals, space, *effort)
            if path is None or all(map(checks.is_free, path, path[1:])):
                return path
        return path

    def _is_within(self, positions: FloatArray) -> bool:
        limits = self.model.description.limits
        return bool(np.all(positions >= limits.lower) and np.all(positions <= limits.upper))

    def _checks(self, start: FloatArray, goals: Sequence[FloatArray], scene: Scene) -> Collisions:
        """Return the checks with the clearance that start and goals allow, or say what is wrong."""
        checks = Collisions(self.model, scene, self.clearance)
        self._require_limits(goals)
        within = [goal for goal in goals if self._is_within(goal)]
        if not checks.collides(start) and any(not checks.collides(goal) for goal in within):
            return checks
        touching = checks.with_clearance(SMALLEST)
        if contact := touching.contact(start):
            raise ArmBlocked(FailureCode.START_OCCUPIED, "at the start", contact)
        contacts = [touching.contact(goal) for goal in within]
        if all(contacts):
            raise ArmBlocked(FailureCode.GOAL_OCCUPIED, "at the goal", contacts[0])
        nearest = max(
            touching.distance(goal)
            for goal, contact in zip(within, contacts, strict=True)
            if not contact
        )
        room = min(self.clearance, touching.distance(start), nearest)
        return checks.with_clearance(0.9 * room)

    def _require_limits(self, goals: Sequence[FloatArray]) -> None:
        if any(map(self._is_within, goals)):
            return
        limits, goal = self.model.description.limits, goals[0]
        joint = int(np.argmax(np.maximum(limits.lower - goal, goal - limits.upper)))
        raise NavigationError(
            FailureCode.UNREACHABLE,
            f"{self.model.description.joints[joint]} would be at {goal[joint]:.3f}, outside its "
            f"limits {limits.lower[joint]:.3f} and {limits.upper[joint]:.3f}",
        )


def shortened(path: FloatArray, checks: Collisions, generator: np.random.Generator) -> FloatArray:
    """Return a shorter path with the same ends.

    Args:
        path: (k, n) waypoints of a free path.
        checks: of its motions.
        generator: of the points that are connected.
    """
    path = _without_detours(path, checks)
    for _ in range(SHORTCUTS):
        if len(path) == 2:
            break
        lengths = np.concatenate(([0.0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()))
        first, second = np.sort(generator.uniform(0.0, lengths[-1], 2))
        before = int(np.searchsorted(lengths, first, side="right"))
        after = int(np.searchsorted(lengths, second, side="right"))
        if before == after:
            continue
        ends = np.array([_at(path, lengths, place) for place in (first, second)])
        if checks.is_free(ends[0], ends[1]):
            path = np.vstack((path[:before], ends, path[after:]))
    return _without_detours(path, checks)


def _without_detours(path: FloatArray, checks: Collisions) -> FloatArray:
    """Leave out the waypoints between two that are connected directly, from the start on."""
    kept, last = [0], len(path) - 1
    while kept[-1] < last:
        here = kept[-1]
        following = (
            node for node in range(last, here + 1, -1) if checks.is_free(path[here], path[node])
        )
        kept.append(next(following, here + 1))
    return path[kept]


def _at(path: FloatArray, lengths: FloatArray, place: float) -> FloatArray:
    """Return the pose at a length of the path."""
    part = min(int(np.searchsorted(lengths, place, side="right")), len(path) - 1)
    share = (place - lengths[part - 1]) / (lengths[part] - lengths[part - 1])
    pose: FloatArray = path[part - 1] + share * (path[part] - path[part - 1])
    return pose


def _angle_between(first: FloatArray, second: FloatArray) -> float:
    cosine = (np.trace(first[:3, :3].T @ second[:3, :3]) - 1.0) / 2.0
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def place_of(pose: FloatArray) -> str:
    """Return the position of a pose (4, 4) for messages, metres."""
    x, y, z = pose[:3, 3]
    return f"({x:.3f}, {y:.3f}, {z:.3f})"
