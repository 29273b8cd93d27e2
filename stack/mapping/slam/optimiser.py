"""Pose graph optimisation by gtsam, the only module that imports it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, log
from typing import Any, NamedTuple

import numpy as np

from stack.mapping.slam.graph import LEAST_INFORMATION, Edge, EdgeKind
from stack.optional_packages import GTSAM
from stack.types import FloatArray, Pose2D

ROBUST_SCALE = 10.0
"""Scale of dynamic covariance scaling: loop edges with a larger squared error than this, in
standard deviations, lose weight."""

FIXED_DEVIATION = 1e-6
"""Metres and radians: deviation of the keyframe that holds the graph in place."""

ITERATIONS = 30

STEP = 30.0
"""Factor between the scales of one optimisation and the next. A true loop disagrees strongly with
the drift before: with the final scale at once it would be rejected as false. So the first scale is
that of the largest disagreement (graduated non-convexity: H. Yang et al., RA-L 2020)."""


SHARED_ERRORS = 4.0
"""Factor of the covariances of odometry and of matches with neighbours: their errors are not
independent. Without it a true loop after metres of drift looks as improbable as a false one."""

ROBUST: tuple[EdgeKind, ...] = ("loop", "marker")
"""Kinds of edges that may be false."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """Result of an optimisation.

    Attributes:
        poses: by id of the node.
        covariances: (3, 3) of x, y, heading of the wanted nodes, each in the axes of its own pose.
    """

    poses: dict[int, Pose2D]
    covariances: dict[int, FloatArray] = field(default_factory=dict)


class GraphOptimiser:
    """Optimises a graph that grows again and again; keeps the factors of the edges it has seen.

    An edge is the same if it is the same object.
    """

    def __init__(self) -> None:
        self._built: dict[int, _Factor] = {}

    def optimise(
        self, poses: Mapping[int, Pose2D], edges: Sequence[Edge], wanted: Sequence[int] = ()
    ) -> Optimum:
        """Return the poses with the least squared errors of the edges.

        Edges of the kinds ROBUST are weighted by dynamic covariance scaling (P. Agarwal et al.,
        "Robust map optimization using dynamic covariance scaling", ICRA 2013), so that false ones
        lose their weight. Levenberg-Marquardt from the poses given, with a decreasing scale. The
        first node of each connected part of the graph does not move. Covariances are the marginals
        of the graph that is linearised at the optimum with these weights.

        Args:
            poses: initial guess, by id of the node.
            edges: between them.
            wanted: nodes whose covariances are wanted.

        Raises:
            InputError: gtsam is not installed.
        """
        if len(poses) < 2:
            return Optimum(dict(poses))
        GTSAM.require("pose graphs need")
        import gtsam

        values = gtsam.Values()
        for number, pose in poses.items():
            values.insert(number, gtsam.Pose2(pose.x, pose.y, pose.heading))
        plain = gtsam.NonlinearFactorGraph()
        tight = gtsam.noiseModel.Isotropic.Sigma(3, FIXED_DEVIATION)
        for anchor in _anchors(poses, edges):
            plain.add(gtsam.PriorFactorPose2(anchor, values.atPose2(anchor), tight))
        robust = []
        for factor in self._factors(gtsam, edges):
            if factor.edge.kind in ROBUST:
                robust.append(factor)
            else:
                plain.add(factor.plain)
        settings = gtsam.LevenbergMarquardtParams()
        settings.setMaxIterations(ITERATIONS)
        settings.setRelativeErrorTol(1e-5)
        graph = plain
        for scale in _scales(poses, [factor.edge for factor in robust]):
            weight = gtsam.noiseModel.mEstimator.DCS.Create(ROBUST_SCALE * scale)
            graph = gtsam.NonlinearFactorGraph(plain)
            for factor in robust:
                model = gtsam.noiseModel.Robust.Create(weight, factor.noise)
                ends = factor.edge.source, factor.edge.target
                graph.add(gtsam.BetweenFactorPose2(*ends, factor.relative, model))
            values = gtsam.LevenbergMarquardtOptimizer(graph, values, settings).optimize()
        found = {}
        for number in poses:
            placed = values.atPose2(number)
            found[number] = Pose2D(placed.x(), placed.y(), placed.theta())
        if not wanted:
            return Optimum(found)
        marginals = gtsam.Marginals(graph, values)
        return Optimum(found, {
            number: np.asarray(marginals.marginalCovariance(number), np.float64)
            for number in wanted
        })  # fmt: skip

    def _factors(self, gtsam: Any, edges: Sequence[Edge]) -> Iterable[_Factor]:
        """Return the factors of edges; forget those of all others."""
        before = self._built
        self._built = {id(edge): before.get(id(edge)) or _factor(gtsam, edge) for edge in edges}
        return self._built.values()


class _Factor(NamedTuple):
    """What gtsam needs of an edge.

    Attributes:
        edge: itself; while it is kept, no other object has its identity.
        relative: its measurement.
        noise: Gaussian.
        plain: the factor without a robust weight.
    """

    edge: Edge
    relative: Any
    noise: Any
    plain: Any


def _scales(poses: Mapping[int, Pose2D], edges: Iterable[Edge]) -> list[float]:
    """Return the factors of the robust scale, from the largest error of robust edges down to 1."""
    largest = max((_squared_error(poses, edge) for edge in edges), default=0.0)
    count = ceil(log(max(1.0, largest / ROBUST_SCALE), STEP))
    return [STEP**k for k in range(count, -1, -1)]


def _squared_error(poses: Mapping[int, Pose2D], edge: Edge) -> float:
    """Return the squared error of an edge in standard deviations."""
    found = poses[edge.target].relative_to(poses[edge.source]).relative_to(edge.relative)
    error = np.array([found.x, found.y, found.heading])
    return float(error @ edge.information @ error)


def _anchors(poses: Mapping[int, Pose2D], edges: Iterable[Edge]) -> list[int]:
    """Return the first keyframe of each connected part."""
    parent = {number: number for number in poses}

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = parent[parent[number]]
            number = parent[number]
        return number

    for edge in edges:
        one, other = sorted((root(edge.source), root(edge.target)))
        parent[other] = one
    return [number for number in poses if root(number) == number]


def _factor(gtsam: Any, edge: Edge) -> _Factor:
    shared = 1.0 if edge.kind in ROBUST else SHARED_ERRORS
    noise = gtsam.noiseModel.Gaussian.Information(_regular(edge.information / shared))
    relative = gtsam.Pose2(edge.relative.x, edge.relative.y, edge.relative.heading)
    plain = gtsam.BetweenFactorPose2(edge.source, edge.target, relative, noise)
    return _Factor(edge, relative, noise, plain)


def _regular(information: FloatArray) -> FloatArray:
    """Return the information, symmetric and at least LEAST_INFORMATION."""
    return 0.5 * (information + information.T) + LEAST_INFORMATION
