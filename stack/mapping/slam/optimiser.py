"""Pose graph optimisation by gtsam, the only module that imports it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stack.mapping.slam.graph import Edge, EdgeKind
from stack.optional_packages import GTSAM
from stack.types import FloatArray, Pose2D

ROBUST_SCALE = 10.0
"""Scale of dynamic covariance scaling: loop edges with a larger squared error than this, in
standard deviations, lose weight."""

FIXED_DEVIATION = 1e-6
"""Metres and radians: deviation of the keyframe that holds the graph in place."""

ITERATIONS = 30

SCALES = (1000.0, 30.0, 1.0)
"""Factors of the robust scale, one after the other. A true loop disagrees strongly with the drift
before the first optimisation: with the final scale at once it would be rejected as false
(graduated non-convexity: H. Yang et al., RA-L 2020)."""


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


def optimise(
    poses: Mapping[int, Pose2D],
    edges: Sequence[Edge],
    wanted: Sequence[int] = (),
) -> Optimum:
    """Return the poses with the least squared errors of the edges.

    Edges of the kinds ROBUST are weighted by dynamic covariance scaling (P. Agarwal et al., "Robust
    map optimization using dynamic covariance scaling", ICRA 2013), so that false ones lose their
    weight. Levenberg-Marquardt from the poses given, with a decreasing scale. The first node of
    each connected part of the graph does not move. Covariances are the marginals of the graph that
    is linearised at the optimum with these weights.

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
    tight = gtsam.noiseModel.Isotropic.Sigma(3, FIXED_DEVIATION)
    priors = [
        gtsam.PriorFactorPose2(anchor, values.atPose2(anchor), tight)
        for anchor in _anchors(poses, edges)
    ]
    factors = [_factor(gtsam, edge) for edge in edges]
    settings = gtsam.LevenbergMarquardtParams()
    settings.setMaxIterations(ITERATIONS)
    settings.setRelativeErrorTol(1e-5)
    graph = gtsam.NonlinearFactorGraph()
    for scale in SCALES:
        robust = gtsam.noiseModel.mEstimator.DCS.Create(ROBUST_SCALE * scale)
        graph = gtsam.NonlinearFactorGraph()
        for prior in priors:
            graph.add(prior)
        for keys, relative, noise, is_robust in factors:
            model = gtsam.noiseModel.Robust.Create(robust, noise) if is_robust else noise
            graph.add(gtsam.BetweenFactorPose2(*keys, relative, model))
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


def _factor(gtsam: Any, edge: Edge) -> tuple[tuple[int, int], Any, Any, bool]:
    """Return the keys, measurement, noise model and whether it is robust, of an edge."""
    noise = gtsam.noiseModel.Gaussian.Information(_regular(edge.information))
    relative = gtsam.Pose2(edge.relative.x, edge.relative.y, edge.relative.heading)
    return (edge.source, edge.target), relative, noise, edge.kind in ROBUST


def _regular(information: FloatArray) -> FloatArray:
    """Return the information, symmetric and at least that of 100 m and 100 rad."""
    return 0.5 * (information + information.T) + 1e-4 * np.eye(3)
