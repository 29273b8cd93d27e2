"""Markers as landmarks of the pose graph: which sightings become edges, and the saved markers.

A sighting may have two possible poses. The sightings of one visit, between which odometry and scans
hardly drift, are explained together: each possible pose of each of them is a hypothesis, and the
one that explains all of them best decides in each sighting (as the survey does, and as max-mixtures
do: E. Olson, P. Agarwal, "Inference on networks of mixtures for robust robot mapping", IJRR 2013).
Where two hypotheses explain a visit about as well, its sightings keep the covariance of both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import atan2

import numpy as np

from stack.localisation.planar import rotation
from stack.mapping.slam.graph import Edge, Landmark, PoseGraph, Sighting
from stack.mapping.slam.optimiser import GraphOptimiser, Optimum
from stack.types import FloatArray, Marker, Pose2D, RelativePose, wrap_angle

MARKER_VIEWS = 3
"""Keyframes from which a marker must have been seen before it is part of the graph."""

FIRST_NODE = 1 << 40
"""Nodes of landmarks have numbers from here on, keyframes lower ones."""

VISIT = 40
"""Keyframes between two sightings, at most, of one visit."""

ALIKE_DIRECTION, INDEPENDENT = 0.1, 2
"""Sightings of a visit from directions that differ by less than this (radians) have alike errors:
they count as at most so many independent ones."""

LEAST_RETURN = 2
"""Sightings of a later visit that it takes to count."""

STARTS = 8
"""Sightings, the most certain ones, whose possible poses are hypotheses."""

HUBER = 9.0
"""Squared error in deviations from which on a sighting's cost grows linearly with the error."""

RIVAL = 4.0
"""Difference of the costs below which two hypotheses explain a visit about as well."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A graph to optimise.

    Attributes:
        poses: of the keyframes, by id.
        edges: between them.
        landmarks: by node.
    """

    poses: dict[int, Pose2D]
    edges: list[Edge]
    landmarks: dict[int, Landmark] = field(default_factory=dict)


def problem_of(graph: PoseGraph) -> Problem:
    """Return a graph as a problem; the landmarks are those of the graph and not copied."""
    poses = {number: keyframe.pose for number, keyframe in graph.keyframes.items()}
    landmarks = dict(enumerate(graph.landmarks.values(), FIRST_NODE))
    return Problem(poses, list(graph.edges), landmarks)


def place_landmarks(graph: PoseGraph, poses: Mapping[int, Pose2D]) -> None:
    """Place the landmarks of a graph at the optimised poses of their nodes."""
    for node, landmark in enumerate(graph.landmarks.values(), FIRST_NODE):
        landmark.pose = poses.get(node, landmark.pose)


def solve(problem: Problem, optimiser: GraphOptimiser | None = None) -> Optimum:
    """Return the optimised keyframes and landmarks, with the covariances of the landmarks.

    Args:
        problem: the graph.
        optimiser: that has optimised the same graph before, if any.

    Raises:
        InputError: gtsam is not installed.
    """
    poses, edges, placed = dict(problem.poses), list(problem.edges), []
    for node, landmark in problem.landmarks.items():
        found = list(landmark_edges(landmark, node, problem.poses))
        if found:
            first = found[0]
            poses[node] = landmark.pose or poses[first.source].compose(first.relative)
            edges += found
            placed.append(node)
    return (optimiser or GraphOptimiser()).optimise(poses, edges, placed)


def landmark_edges(landmark: Landmark, node: int, poses: Mapping[int, Pose2D]) -> Iterable[Edge]:
    """Yield the edges to a landmark; none while each visit has fewer than MARKER_VIEWS sightings.

    Args:
        landmark: with its sightings.
        node: of the landmark.
        poses: of the keyframes.
    """
    visits = visits_of(landmark)
    if not any(len(visit) >= MARKER_VIEWS for visit in visits):
        return
    for visit in visits:
        if len(visit) < min(LEAST_RETURN, MARKER_VIEWS):
            continue
        seen = {number: landmark.sightings[number] for number in visit}
        chosen = _resolved(seen, poses)
        directions = [_direction(one.pose) for one in chosen.values()]
        for (number, one), direction in zip(chosen.items(), directions, strict=True):
            alike = sum(abs(wrap_angle(direction - d)) < ALIKE_DIRECTION for d in directions)
            information = min(1.0, INDEPENDENT / alike) * _information(one)
            yield Edge(number, node, one.pose, information, "marker")


def visits_of(landmark: Landmark) -> list[list[int]]:
    """Return the keyframes of the sightings, in order, one list for each visit."""
    visits: list[list[int]] = []
    for number in sorted(landmark.sightings):
        if visits and number - visits[-1][-1] <= VISIT:
            visits[-1].append(number)
        else:
            visits.append([number])
    return visits


def returns_of(landmark: Landmark) -> int:
    """Return the sightings of the newest visit once it closes a loop; 0 before, and of the first.

    A visit closes a loop with LEAST_RETURN sightings.
    """
    visits = visits_of(landmark)
    count = len(visits[-1])
    return count if len(visits) > 1 and count >= LEAST_RETURN else 0


def markers_of(graph: PoseGraph, optimum: Optimum) -> tuple[Marker, ...]:
    """Return the landmarks that an optimisation has placed, with standard deviations, in order.

    They are placed relative to the keyframes as these are now: an optimum moves both.
    """
    found = []
    for node, (key, landmark) in enumerate(graph.landmarks.items(), FIRST_NODE):
        if node not in optimum.covariances:
            continue
        best = min(landmark.sightings, key=lambda number: landmark.sightings[number].variance)
        optimal = optimum.poses[node].relative_to(optimum.poses[best])
        pose = graph.keyframes[best].pose.compose(optimal)
        covariance = optimum.covariances[node]
        found.append(Marker(
            key[1], landmark.size, (pose.x, pose.y, landmark.height), pose.heading, key[0],
            float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1])),
            float(np.sqrt(covariance[2, 2])),
        ))  # fmt: skip
    return tuple(sorted(found, key=lambda marker: (marker.dictionary, marker.number)))


def _resolved(seen: Mapping[int, Sighting], poses: Mapping[int, Pose2D]) -> dict[int, RelativePose]:
    """Return the pose of each sighting of a visit that fits with the others."""
    placed = [
        [_placed(one, poses[number]) for one in sighting.candidates]
        for number, sighting in seen.items()
    ]
    surest = sorted(seen, key=lambda number: seen[number].variance)[:STARTS]
    rows = [k for k, number in enumerate(seen) if number in surest]
    hypotheses = [one.pose for k in rows for one in placed[k]]
    costs = [np.array([_costs(pose, options).min() for options in placed]).sum()
             for pose in hypotheses]  # fmt: skip
    best = hypotheses[int(np.argmin(costs))]
    chosen = [int(np.argmin(_costs(best, options))) for options in placed]
    for pose, cost in zip(hypotheses, costs, strict=True):
        other = [int(np.argmin(_costs(pose, options))) for options in placed]
        turned = abs(wrap_angle(best.heading - pose.heading))
        if other != chosen and cost < min(costs) + RIVAL and turned >= 0.1:
            return {number: _joined(sighting.candidates) for number, sighting in seen.items()}
    return {
        number: sighting.candidates[k]
        for (number, sighting), k in zip(seen.items(), chosen, strict=True)
    }


def _direction(marker: Pose2D) -> float:
    """Return the direction of the base seen from a marker, radians from the marker's normal."""
    seen_from = marker.inverse()
    return atan2(seen_from.y, seen_from.x)


def _placed(seen: RelativePose, keyframe: Pose2D) -> RelativePose:
    """Return a pose relative to a keyframe in the map frame, with its covariance."""
    turn = rotation(keyframe.heading)
    pose = keyframe.compose(seen.pose)
    return RelativePose(pose, turn @ seen.covariance @ turn.T, seen.share)


def _costs(pose: Pose2D, options: list[RelativePose]) -> FloatArray:
    """Return the cost of a marker's pose by each possible pose of a sighting."""
    found = []
    for one in options:
        turned = wrap_angle(pose.heading - one.pose.heading)
        off = np.array([pose.x - one.pose.x, pose.y - one.pose.y, turned])
        square = float(off @ np.linalg.solve(one.covariance, off))
        square = square if square <= HUBER else 2.0 * np.sqrt(HUBER * square) - HUBER
        found.append(square - 2.0 * np.log(max(one.share, 1e-3)))
    return np.array(found)


def _joined(candidates: tuple[RelativePose, ...]) -> RelativePose:
    """Return one pose with the mean and the covariance of all candidates."""
    if len(candidates) == 1:
        return candidates[0]
    first = candidates[0].pose
    rows = np.array([
        (one.pose.x, one.pose.y, first.heading + wrap_angle(one.pose.heading - first.heading))
        for one in candidates
    ])  # fmt: skip
    shares = np.array([one.share for one in candidates])
    mean = shares @ rows
    off = rows - mean
    covariance = (off * shares[:, None]).T @ off
    covariance += np.einsum("n,nab->ab", shares, [one.covariance for one in candidates])
    x, y, heading = (float(value) for value in mean)
    return RelativePose(Pose2D(x, y, wrap_angle(heading)), covariance)


def _information(seen: RelativePose) -> FloatArray:
    """Return the information of a relative pose in the axes of that pose."""
    turn = rotation(-seen.pose.heading)
    information: FloatArray = np.linalg.inv(turn @ seen.covariance @ turn.T).astype(np.float64)
    return 0.5 * (information + information.T)
