"""Relocalisation by appearance in a mapped office, and refusal in another one.

The office is mapped by a mission: the robot drives to stops in all rooms, turns once round at each
and saves map and keyframes. Then a robot stands at random poses of this office and of another one,
and turns round by the steps of `relocalise`. The pictures, scans and decisions are those of the
behaviour; only the driving between the stops is left out.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import cos, degrees, pi, radians, sin
from pathlib import Path
from statistics import median

import numpy as np

from behaviours._sensing.marker_pose import Hypothesis, merged
from behaviours._sensing.place_pose import place_hypothesis
from behaviours.localisation.relocalise import STEP_RANGE, STEP_SHARE, Relocalise
from missions.bench.bench import wilson
from missions.execution.component_choices import chosen
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS, load_map, load_robot
from missions.execution.running import execute
from stack.components import Estimator
from stack.perception.places.keyframe_files import read_keyframes
from stack.perception.places.parameters import PlaceParameters
from stack.perception.places.recogniser import PlaceRecogniser
from stack.sim.scene_state import SceneState
from stack.sim.sensors.lidar import Lidar
from stack.sim.sensors.rendering import CameraRenderer, RenderRequest, RenderSetup
from stack.telemetry.records import MissionState
from stack.types import FloatArray, Image, PlaceSighting, Pose2D, Scan, wrap_angle
from tests.benchmarks.benchmark import FILES, in_order
from tests.benchmarks.place_offices import PosterOffice
from tests.benchmarks.table import Rows

HELD_OUT = 9000
"""Seed of the office that is mapped; the next one is the other office."""

POSES = 100
CLEARANCE = 0.3
"""Metres from the robot's centre to the nearest obstacle, at least."""

GOOD_DISTANCE, GOOD_ANGLE = 0.15, radians(3.0)
"""Errors of a right pose, metres and radians."""

MIN_FIT: float = Relocalise.ports()["min_fit"].default
"""The default of the behaviour."""

LOOSE = PlaceParameters(least_inliers=6, largest_deviation=2.0)
"""What the curve is made from: nothing is refused that has a pose."""


@dataclass(frozen=True)
class Picture:
    """What was recognised in one picture: inliers and deviation of the best pose, its errors."""

    inliers: int
    deviation: float
    distance: float
    angle: float

    @property
    def is_right(self) -> bool:
        """Whether the pose is within the limits."""
        return self.distance <= GOOD_DISTANCE and self.angle <= GOOD_ANGLE


@dataclass(frozen=True)
class Outcome:
    """What a robot at one pose has decided.

    Attributes:
        accepted: whether it has accepted a pose. stops: number of pictures until then, or all.
        taken: pictures of the whole turn.
        distance: error of that pose, metres. angle: radians.
        pictures: what each picture of the whole turn shows.
    """

    accepted: bool
    stops: int
    taken: int
    distance: float
    angle: float
    pictures: tuple[Picture, ...]

    @property
    def is_right(self) -> bool:
        """Whether a pose was accepted that is within the limits."""
        return self.accepted and self.distance <= GOOD_DISTANCE and self.angle <= GOOD_ANGLE


class Office:
    """An office with the camera and the lidar of `scout`."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.office = PosterOffice(seed)
        self.case = self.office.write(folder / "worlds")
        self.robot = load_robot("scout", MISSIONS)
        assert self.robot.camera is not None
        world = self.case.world
        setup = RenderSetup(world, self.robot.model, self.robot.camera)
        self._seed, self._renderer = seed, CameraRenderer(setup)
        lidar = replace(self.robot.all_lidars["lidar"], rotation_time=0.0)
        self._lidar, self._taken = Lidar(lidar, world, seed), 0

    def look(self, pose: Pose2D) -> tuple[Image, Scan]:
        """Return a picture and a scan from a true pose."""
        assert self.robot.camera is not None
        self._taken += 1
        half = pose.heading / 2.0
        request = RenderRequest(
            self._taken, (pose.x, pose.y, 0.0), (0.0, 0.0, sin(half), cos(half)),
            np.zeros((0, 3)), {}, seed=self._seed,
        )  # fmt: skip
        pixels = np.asarray(self._renderer.render(request), np.uint8)
        scan = self._lidar.scan([(0.0, pose)], SceneState(), self._taken, 0.0)
        return Image(float(self._taken), pixels, self.robot.camera.model), scan

    def close(self) -> None:
        """Close the renderer."""
        self._renderer.close()


def mapped(office: Office, folder: Path) -> Path:
    """Return the folder of the office's map and keyframes; map it if it does not exist."""
    target = folder.absolute() / f"map_{office.case.name}"
    if not target.exists():
        assert office.case.file is not None
        tour = office.office.tour()
        stops = json.dumps([[round(pose.x, 2), round(pose.y, 2), 0.0] for pose in tour])
        options = RunOptions(
            seed=0, world=str(office.case.file.resolve()), serve=False,
            arguments={"stops": stops, "map": str(target)},
            start=f"{tour[0].x:.2f},{tour[0].y:.2f},0",
        )  # fmt: skip
        report = execute(prepare(FILES / "places.yaml", options), options, [])
        assert report.status == MissionState.SUCCESS, report.reason
    return target


def asked(
    office: Office, poses: Sequence[Pose2D], recogniser: PlaceRecogniser, estimator: Estimator
) -> list[Outcome]:
    """Return what a robot decides at poses of an office, by the keyframes and map of one."""
    outcomes = []
    for number, pose in enumerate(poses, 1):
        outcomes.append(_turned_round(office, pose, recogniser, estimator))
        print(f"{office.case.name} {number}: {_line(outcomes[-1])}", file=sys.stderr)
    return outcomes


def asked_with(saved: Path, poses: int, folder: Path, seed: int) -> list[Outcome]:
    """Return what a robot decides in the office of a seed, by a saved map and its keyframes."""
    found = read_keyframes(saved)
    assert found is not None, "the tour has recorded no keyframe"
    recogniser = PlaceRecogniser(found[0], LOOSE, found[1])
    office = Office(seed, folder)
    try:
        grid = load_map(str(saved), saved)
        estimator = chosen("localisation", None, {}).create(office.robot, grid, 0)
        return asked(office, office.office.poses(poses, CLEARANCE), recogniser, estimator)
    finally:
        office.close()


def run(poses: int, folder: Path, jobs: int = 1, seed: int = HELD_OUT) -> Rows:
    """Figures of both offices; writes the curve to folder/places.png."""
    own = Office(seed, folder)
    try:
        saved = mapped(own, folder)
    finally:
        own.close()
    work = partial(asked_with, saved, poses, folder)
    seeds = (seed, seed + 1)
    near, far = in_order(work, seeds, jobs)
    curve(folder / "places.png", near, far)
    found = read_keyframes(saved)
    count = 0 if found is None else len(found[0])
    return [
        _row("the mapped office", near, count, own=True),
        _row("another office", far, count, own=False),
    ]


def _turned_round(
    office: Office, pose: Pose2D, recogniser: PlaceRecogniser, estimator: Estimator
) -> Outcome:
    view = 2.0 * np.arctan(0.5 * office.robot.camera.model.width / _focal(office))
    step = min(max(STEP_SHARE * float(view), STEP_RANGE[0]), STEP_RANGE[1])
    count = int(np.ceil(2.0 * pi / step - 1e-6)) + 1
    known: list[Hypothesis] = []
    pictures: list[Picture] = []
    accepted: tuple[int, Pose2D] | None = None
    for number in range(count):
        turned = Pose2D(0.0, 0.0, wrap_angle(number * step))
        truth = pose.compose(turned)
        image, scan = office.look(truth)
        sightings = recogniser.recognise(image, scan.points())
        if sightings:
            pictures.append(_picture(sightings[0], truth))
        if accepted is not None:
            continue
        kept = [one for one in sightings if _is_accepted(one)]
        hypothesis = place_hypothesis(
            kept, turned, turned, lambda at, scan=scan: estimator.fit_at(at, scan), MIN_FIT
        )
        if hypothesis is not None:
            # The stops of a turn are seconds apart.
            stamped = replace(hypothesis, stamps=(2.0 * number,))
            known = merged(known, [stamped], turned)
        best = known[0] if known else None
        if best is not None and best.is_sure and (len(known) == 1 or best.leads(known[1])):
            accepted = number + 1, best.pose(turned)
            truth_then = truth
    if accepted is None:
        return Outcome(False, count, count, np.inf, np.inf, tuple(pictures))
    stops, found = accepted
    angle = abs(wrap_angle(found.heading - truth_then.heading))
    return Outcome(True, stops, count, found.distance_to(truth_then), angle, tuple(pictures))


def _focal(office: Office) -> float:
    assert office.robot.camera is not None
    return office.robot.camera.model.focal_length


def _is_accepted(sighting: PlaceSighting) -> bool:
    p = PlaceParameters()
    return sighting.inliers >= p.least_inliers and sighting.deviation <= p.largest_deviation


def _picture(sighting: PlaceSighting, truth: Pose2D) -> Picture:
    angle = abs(wrap_angle(sighting.pose.heading - truth.heading))
    return Picture(
        sighting.inliers, sighting.deviation, sighting.pose.distance_to(truth), angle
    )  # fmt: skip


def _line(outcome: Outcome) -> str:
    if not outcome.accepted:
        return f"nothing accepted after {outcome.stops} pictures"
    error = f"{100 * outcome.distance:.1f} cm, {degrees(outcome.angle):.1f} deg"
    return f"accepted after {outcome.stops} pictures, {error}"


def _row(name: str, outcomes: Sequence[Outcome], keyframes: int, *, own: bool) -> dict[str, object]:
    accepted = [one for one in outcomes if one.accepted]
    right = [one for one in outcomes if own and one.is_right]
    low, high = wilson(len(right) if own else len(accepted), len(outcomes))
    errors = [100.0 * one.distance for one in accepted]
    turns = [degrees(one.angle) for one in accepted]
    return {
        "poses in": name, "keyframes": keyframes, "poses": len(outcomes),
        "accepted": len(accepted), "right": len(right), "95 %": f"{low:.0%} to {high:.0%}",
        "pictures": median(one.stops for one in outcomes),
        "error cm": median(errors) if own and errors else None,
        "largest cm": max(errors) if own and errors else None,
        "error °": median(turns) if own and turns else None,
        "largest °": max(turns) if own and turns else None,
    }  # fmt: skip


def points_of(near: Sequence[Outcome], far: Sequence[Outcome]) -> FloatArray:
    """Return the curve of single pictures: (n, 3) least inliers, recall, precision.

    Recall is the share of the pictures of the mapped office that give a right pose; precision the
    share of right ones among all poses that are accepted in either office. Poses with a larger
    deviation than the default are refused.
    """
    limit = PlaceParameters().largest_deviation
    own = [one for outcome in near for one in outcome.pictures if one.deviation <= limit]
    wrong = [one for outcome in far for one in outcome.pictures if one.deviation <= limit]
    total = sum(outcome.taken for outcome in near)
    rows = []
    for least in range(6, 61):
        right = sum(one.is_right for one in own if one.inliers >= least)
        accepted = sum(one.inliers >= least for one in (*own, *wrong))
        if accepted:
            rows.append((least, right / total, right / accepted))
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def curve(path: Path, near: Sequence[Outcome], far: Sequence[Outcome]) -> None:
    """Write the curve of `points_of` as PNG, with the least number of inliers at some points."""
    import cv2

    side, margin, grey, blue = 480, 60, (200, 200, 200), (200, 110, 30)
    pixels = np.full((side + 2 * margin, side + 2 * margin, 3), 255, np.uint8)

    def at(recall: float, precision: float) -> tuple[int, int]:
        return margin + round(recall * side), margin + side - round(precision * side)

    def write(text: str, place: tuple[int, int]) -> None:
        cv2.putText(pixels, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (30, 30, 30), 1,
                    cv2.LINE_AA)  # fmt: skip

    for share in np.linspace(0.0, 1.0, 6):
        cv2.line(pixels, at(share, 0.0), at(share, 1.0), grey, 1)
        cv2.line(pixels, at(0.0, share), at(1.0, share), grey, 1)
        write(f"{share:.1f}", (at(share, 0.0)[0] - 10, at(0.0, 0.0)[1] + 18))
        write(f"{share:.1f}", (margin - 34, at(0.0, share)[1] + 5))
    rows = points_of(near, far)
    line = np.array([at(recall, precision) for _, recall, precision in rows.tolist()])
    cv2.polylines(pixels, [line.reshape(-1, 1, 2).astype(np.int32)], False, blue, 2, cv2.LINE_AA)
    chosen_one = PlaceParameters().least_inliers
    for least, recall, precision in rows.tolist():
        if least in (6, chosen_one, 16, 30, 60):
            cv2.circle(pixels, at(recall, precision), 5, blue, -1, cv2.LINE_AA)
            write(f"{least:.0f}", (at(recall, precision)[0] - 8, at(recall, precision)[1] - 10))
    write("recall of single pictures", (margin + side // 2 - 80, side + margin + 42))
    write("precision, against the least number of inliers (at the dots)", (margin, margin - 30))
    done, png = cv2.imencode(".png", pixels)
    if done:
        path.write_bytes(png.tobytes())


def main() -> None:
    """Measure, print the figures and write the curve."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--poses", type=int, default=POSES, help=f"in each office [{POSES}]")
    arguments.add_argument("--seed", type=int, default=HELD_OUT, help=f"[{HELD_OUT}]")
    arguments.add_argument("--jobs", type=int, default=1, help="processes, 1 or 2 [1]")
    arguments.add_argument("--out", type=Path, default=Path("bench/places"), help="folder")
    given = arguments.parse_args()
    for row in run(given.poses, given.out, given.jobs, given.seed):
        print(json.dumps(row, ensure_ascii=False))


if __name__ == "__main__":
    main()
