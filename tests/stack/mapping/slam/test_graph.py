"""Pose graph: edges, reversal, removal of keyframes."""

from dataclasses import replace

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.mapping.slam.graph import Edge, Keyframe, PoseGraph, reversed_edge
from stack.types import Pose2D, Scan

SCAN = Scan(0.0, np.ones(4, np.float32), 0.0, 0.1, 0.1, 10.0)


def chain(*poses: Pose2D) -> PoseGraph:
    graph = PoseGraph()
    for number, pose in enumerate(poses):
        graph.add_keyframe(Keyframe(number, float(number), pose, pose, SCAN))
        if number:
            relative = pose.relative_to(poses[number - 1])
            information = np.diag([400.0, 100.0, 2500.0])
            graph.add_edge(Edge(number - 1, number, relative, information, "match"))
    return graph


def test_the_reverse_of_the_reverse_is_the_edge():
    rng = np.random.default_rng(3)
    factor = rng.normal(size=(3, 3))
    edge = Edge(0, 1, Pose2D(2.0, -1.0, 0.7), factor @ factor.T + np.eye(3), "loop")
    again = reversed_edge(reversed_edge(edge))
    assert again.relative.distance_to(edge.relative) < 1e-12
    assert np.allclose(again.information, edge.information)


def test_the_covariance_of_a_reversed_edge_is_that_of_sampled_inverses():
    # Monte Carlo: perturb the measurement in its own frame, invert, look at the scatter.
    covariance = np.diag([0.01, 0.02, 0.005]) ** 2
    measured = Pose2D(3.0, 1.0, 1.2)
    edge = Edge(0, 1, measured, np.linalg.inv(covariance), "match")
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(3), covariance, 5_000)
    back = measured.inverse()
    errors = [measured.compose(Pose2D(*d)).inverse().relative_to(back) for d in draws]
    sampled = np.cov(np.array([[e.x, e.y, e.heading] for e in errors]).T)
    assert np.allclose(np.linalg.inv(reversed_edge(edge).information), sampled, rtol=0.1, atol=6e-6)


def test_a_removed_keyframe_leaves_its_neighbours_connected_with_the_sum_of_both_covariances():
    graph = chain(Pose2D(0.0, 0.0), Pose2D(1.0, 0.0), Pose2D(2.0, 0.0))
    graph.remove_keyframe(1)
    assert sorted(graph.keyframes) == [0, 2] and len(graph.edges) == 1
    (edge,) = graph.edges
    assert {edge.source, edge.target} == {0, 2} and graph.edges_of(0) == [edge]
    forward = edge if edge.source == 0 else reversed_edge(edge)
    assert forward.relative.distance_to(Pose2D(2.0, 0.0)) < 1e-12
    # By hand: x variances add (1/400 each); y gets the lever of 1 m times the heading's 1/2500.
    covariance = np.linalg.inv(forward.information)
    assert covariance[0, 0] == pytest.approx(2 / 400, rel=1e-5)
    assert covariance[1, 1] == pytest.approx(2 / 100 + 1 / 2500, rel=1e-5)


def test_a_removed_keyframe_may_have_edges_that_tell_nothing_along_a_corridor_or_nothing_at_all():
    graph = chain(Pose2D(0.0, 0.0), Pose2D(1.0, 0.0), Pose2D(2.0, 0.0))
    graph.add_keyframe(replace(graph.keyframes[0], id=3))
    graph.add_keyframe(replace(graph.keyframes[0], id=4))
    across = np.diag([0.0, 100.0, 2500.0])
    graph.add_edge(Edge(1, 3, Pose2D(1.0, 0.0), across, "match"))
    graph.add_edge(Edge(1, 4, Pose2D(1.0, 0.0), np.zeros((3, 3)), "match"))
    graph.remove_keyframe(1)
    assert sorted(e.source + e.target for e in graph.edges) == [2, 3, 4]  # all joined with 0
    _, along, nothing = graph.edges
    assert along.information[0, 0] < 1e-3 and np.abs(nothing.information).max() < 1e-3
    assert along.covariance[1, 1] == pytest.approx(2 / 100 + 1 / 2500, rel=1e-2)


def test_edges_without_keyframes_and_ids_used_twice_are_refused():
    graph = chain(Pose2D(0.0, 0.0), Pose2D(1.0, 0.0))
    with pytest.raises(ParameterError, match="no keyframe 7"):
        graph.add_edge(Edge(0, 7, Pose2D(0.0, 0.0), np.eye(3), "loop"))
    with pytest.raises(ParameterError, match="keyframe 1 is in the graph twice"):
        graph.add_keyframe(graph.keyframes[1])
