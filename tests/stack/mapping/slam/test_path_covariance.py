"""Covariances along the paths of a graph, against hand calculation and a scatter of chains."""

import numpy as np
import pytest

from stack.mapping.slam.graph import Edge, Keyframe, PoseGraph
from stack.mapping.slam.optimiser import SHARED_ERRORS
from stack.mapping.slam.path_covariance import PathCovariance
from stack.types import Pose2D
from tests.stack.mapping.slam.rooms import ROOM, scan_at

SCAN = scan_at(ROOM, Pose2D(1.0, 1.0))
DEVIATIONS = np.array([0.01, 0.02, 0.005])


def chain(steps: list[Pose2D], shift: float = 1.0) -> PoseGraph:
    """Keyframes one step apart; `shift` scales the information."""
    graph, pose = PoseGraph(), Pose2D(0.0, 0.0)
    graph.add_keyframe(Keyframe(0, 0.0, pose, pose, SCAN))
    for k, step in enumerate(steps, 1):
        pose = pose.compose(step)
        graph.add_keyframe(Keyframe(k, 0.1 * k, pose, pose, SCAN))
        graph.add_edge(Edge(k - 1, k, step, shift * np.diag(DEVIATIONS**-2), "match"))
    return graph


def test_a_straight_chain_has_the_covariance_of_a_random_walk():
    # y of node n is the sum of its steps and of the headings before, each times the rest of the
    # way: n 0.02² + 0.005² sum k², k = 0 .. n - 1, for steps of 1 m.
    n = 20
    paths = PathCovariance(chain([Pose2D(1.0, 0.0)] * n)).from_keyframe(0)
    x, y, heading = np.diag(paths.covariances[n]) / SHARED_ERRORS
    assert x == pytest.approx(n * 0.01**2, rel=1e-2)
    assert y == pytest.approx(n * 0.02**2 + 0.005**2 * sum(k * k for k in range(n)), rel=1e-2)
    assert heading == pytest.approx(n * 0.005**2, rel=1e-2)


def test_a_bent_chain_has_the_scatter_of_drawn_chains():
    rng = np.random.default_rng(1)
    steps = [Pose2D(1.0, 0.2, 0.3 * (k % 3 - 1)) for k in range(12)]
    paths = PathCovariance(chain(steps)).from_keyframe(0)
    end = Pose2D(0.0, 0.0)
    for step in steps:
        end = end.compose(step)
    errors = []
    for _ in range(4000):
        drawn = Pose2D(0.0, 0.0)
        for step in steps:
            drawn = drawn.compose(step).compose(Pose2D(*rng.normal(0.0, DEVIATIONS)))
        error = drawn.relative_to(end)
        errors.append((error.x, error.y, error.heading))
    # 4000 draws: a variance is known to 2.2 %.
    np.testing.assert_allclose(
        np.cov(np.array(errors).T), paths.covariances[12] / SHARED_ERRORS, rtol=0.1, atol=3e-5
    )


def test_the_better_path_counts_and_backward_edges_too():
    graph = chain([Pose2D(1.0, 0.0)] * 10)
    before = PathCovariance(graph)
    far = before.from_keyframe(10).costs[0]
    graph.add_edge(Edge(10, 0, Pose2D(-10.0, 0.0), np.diag(DEVIATIONS**-2), "loop"))
    closed = before.from_keyframe(10)
    assert closed.costs[0] == pytest.approx(0.1 * far, rel=1e-2)
    assert closed.costs[1] == pytest.approx(0.2 * far, rel=1e-2)
    graph.replace_edges(graph.edges[:-1])
    assert before.from_keyframe(10).costs[0] == pytest.approx(far)


def test_an_unconnected_keyframe_has_no_path():
    graph = chain([Pose2D(1.0, 0.0)] * 2)
    graph.add_keyframe(Keyframe(7, 1.0, Pose2D(5.0, 5.0), Pose2D(0.0, 0.0), SCAN))
    paths = PathCovariance(graph).from_keyframe(0)
    assert paths.numbers.tolist() == [0, 1, 2, 7] and np.isinf(paths.costs[3])
