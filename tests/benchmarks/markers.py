"""Error of the pose from a marker, against distance and angle: `run()` gives a row for each."""

from __future__ import annotations

from dataclasses import replace
from math import cos, degrees, pi, radians, sin
from pathlib import Path

import numpy as np

from robots.load import find_robot, read_robot
from stack.perception.markers.detector import MarkerDetector
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Wall
from stack.streams import stream
from stack.types import CameraModel, Image, Marker, Pose2D, PoseCandidate, wrap_angle
from tests.benchmarks.table import Rows
from tests.stack.sim.sim_rover import EMPTY

DISTANCES, ANGLES = (0.75, 1.5, 2.5, 3.5), (0.0, 30.0, 60.0)
"""Metres from the camera's base; degrees from the marker's normal."""

PICTURES = 100
ASIDE = radians(15.0)
"""Largest angle between the robot's heading and the marker."""

AWAY, OFF_NORMAL = 0.1, radians(5.0)
"""Metres and radians within which distance and angle vary."""

OTHER_POSE = 0.05
"""Metres by which another solution is nearer to the truth than the best one, to count."""

CHI_SQUARE = 7.815
"""95 % quantile of the chi-square distribution with three degrees of freedom."""

MARKER = Marker(7, 0.2, (0.0, 0.0, 0.4), 0.0)
WALL = Wall(np.array([[-0.05, -3.0], [-0.05, 3.0]]))


def run() -> Rows:
    """Rows of detections, errors in cm and degrees, mirrored poses that fit better, containment."""
    robot = read_robot(find_robot("scout", Path()))
    assert robot.camera is not None
    world = replace(EMPTY, markers=(MARKER,), walls=(WALL,))
    setup = RenderSetup(world, robot.model, robot.camera, "camera")
    renderer, detector = CameraRenderer(setup), MarkerDetector([MARKER])
    places = [(distance, angle) for distance in DISTANCES for angle in ANGLES]
    try:
        return [_row(renderer, detector, robot.camera.model, place) for place in places]
    finally:
        renderer.close()


def _row(
    renderer: CameraRenderer, detector: MarkerDetector, model: CameraModel,
    place: tuple[float, float],
) -> dict[str, float]:  # fmt: skip
    """Figures of PICTURES random poses."""
    distance, angle = place
    random = stream(0, f"markers {distance:g} m {angle:g} deg")
    errors, mirrored, fixes, contained = [], 0, 0, 0
    for number in range(PICTURES):
        way = distance + random.uniform(-AWAY, AWAY)
        side = radians(angle) * random.choice([-1.0, 1.0]) + random.uniform(-OFF_NORMAL, OFF_NORMAL)
        turn = wrap_angle(side + pi + random.uniform(-ASIDE, ASIDE))
        pose = Pose2D(float(way * cos(side)), float(way * sin(side)), float(turn))
        request = RenderRequest(
            number, (pose.x, pose.y, 0.0), (0.0, 0.0, sin(turn / 2), cos(turn / 2)),
            np.empty((0, 3)), {}, seed=1,
        )  # fmt: skip
        image = Image(float(number), np.asarray(renderer.render(request), np.uint8), model)
        sightings = detector.sightings(image)
        if not sightings:
            continue
        away = [item.pose.distance_to(pose) for item in sightings[0].candidates]
        best = int(np.argmin(away))
        fix = detector.fix(image)
        if fix is not None:
            fixes += 1
            contained += any(_contains(one, pose) for one in fix.candidates)
        mirrored += away[0] - away[best] > OTHER_POSE
        heading = wrap_angle(sightings[0].candidates[best].pose.heading - pose.heading)
        errors.append((away[best], abs(degrees(heading))))
    metres, turned = np.array(errors).T if errors else np.full((2, 1), np.nan)
    return {
        "distance": distance, "angle": angle, "detected %": 100.0 * len(errors) / PICTURES,
        "error cm": 100.0 * float(np.median(metres)),
        "error 95 % cm": 100.0 * float(np.percentile(metres, 95)),
        "error °": float(np.median(turned)), "error 95 % °": float(np.percentile(turned, 95)),
        "mirrored %": 100.0 * mirrored / max(1, len(errors)),
        "contained %": 100.0 * contained / max(1, fixes),
    }  # fmt: skip


def _contains(candidate: PoseCandidate, truth: Pose2D) -> bool:
    """Return whether the 95 % ellipsoid of x, y and heading contains the truth."""
    turn = wrap_angle(candidate.pose.heading - truth.heading)
    off = np.array([candidate.pose.x - truth.x, candidate.pose.y - truth.y, turn])
    return float(off @ np.linalg.solve(candidate.covariance, off)) <= CHI_SQUARE
