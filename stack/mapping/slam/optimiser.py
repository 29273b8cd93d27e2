"""Pose graph optimisation by gtsam, the only module that imports it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from stack.errors import InputError
from stack.mapping.slam.graph import Edge, PoseGraph
from stack.types import FloatArray, Pose2D

FIXED_DEVIATION = 1e-6
"""Metres and radians: deviation of the keyframe that holds the graph in place."""

ITERATIONS = 50


def optimise(
    poses: Mapping[int, Pose2D],
    edges: Iterable[Edge],
    robust_scale: float,
    fixed: int | None = None,
) -> dict[int, Pose2D]:
    """Return the poses with the least squared errors of the edges.

    Loop edges are weighted by dynamic covariance scaling (P. Agarwal et al., "Robust map
    optimization using dynamic covariance scaling", ICRA 2013), so that false ones lose their
    weight. Levenberg-Marquardt from the poses given.

    Args:
        poses: initial guess, by id of the keyframe.
        edges: between them.
        robust_scale: Φ of dynamic covariance scaling.
        fixed: id of the keyframe that does not move; None: the first one.

    Raises:
        InputError: gtsam is not installed.
    """
    if len(poses) < 2:
        return dict(poses)
    gtsam = _gtsam()
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for number, pose in poses.items():
        values.insert(number, gtsam.Pose2(pose.x, pose.y, pose.heading))
    anchor = next(iter(poses)) if fixed is None else fixed
    tight = gtsam.noiseModel.Isotropic.Sigma(3, FIXED_DEVIATION)
    graph.add(gtsam.PriorFactorPose2(anchor, values.atPose2(anchor), tight))
    robust = gtsam.noiseModel.mEstimator.DCS.Create(robust_scale)
    for edge in edges:
        noise = gtsam.noiseModel.Gaussian.Information(_regular(edge.information))
        if edge.kind == "loop":
            noise = gtsam.noiseModel.Robust.Create(robust, noise)
        relative = gtsam.Pose2(edge.relative.x, edge.relative.y, edge.relative.heading)
        graph.add(gtsam.BetweenFactorPose2(edge.source, edge.target, relative, noise))
    settings = gtsam.LevenbergMarquardtParams()
    settings.setMaxIterations(ITERATIONS)
    settings.setRelativeErrorTol(1e-6)
    result = gtsam.LevenbergMarquardtOptimizer(graph, values, settings).optimize()
    found = {}
    for number in poses:
        pose = result.atPose2(number)
        found[number] = Pose2D(pose.x(), pose.y(), pose.theta())
    return found


def optimise_graph(graph: PoseGraph, robust_scale: float) -> dict[int, Pose2D]:
    """Return the optimised poses of a graph; the first keyframe stays."""
    poses = {number: keyframe.pose for number, keyframe in graph.keyframes.items()}
    return optimise(poses, graph.edges, robust_scale)


def _regular(information: FloatArray) -> FloatArray:
    """Return the information, symmetric and at least that of 100 m and 100 rad."""
    return 0.5 * (information + information.T) + 1e-4 * np.eye(3)


def _gtsam() -> Any:
    try:
        import gtsam
    except ImportError:
        raise InputError(
            "SLAM needs gtsam, which is not installed; install it with"
            " `pip install 'treepilot[slam]'`"
        ) from None
    return gtsam
