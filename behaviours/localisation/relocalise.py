"""Recovery of the robot's pose when the localisation is lost."""

from __future__ import annotations

from collections.abc import Generator
from math import degrees, pi, radians

import numpy as np
from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE, DrivingBehaviour, Steps
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours._sensing.marker_pose import Hypothesis, hypotheses, merged
from behaviours._sensing.place_pose import place_hypothesis
from behaviours._sensing.wall_geometry import room_ahead
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import FailureCode, Image, Twist, wrap_angle

FIRST_PICTURE, NEXT_PICTURE = 2.0, 1.0
"""Seconds to wait for a picture from a camera that was off, and from one that is on."""
CONFIRM_AFTER, CONFIRM_WITHIN = 1.0, 2.0
"""Seconds after which a new pose can be confirmed, and within which it must be."""
FULL_TURN, LONGEST_TURN = 2.0 * pi, 2.5 * pi
STEP_SHARE, STEP_RANGE = 0.6, (radians(20.0), radians(60.0))
"""Part of the field of view to turn between two stops, so that pictures overlap; and its limits."""
PICTURE_DEVIATION = 0.1
"""Standard deviation of a pose from a picture, metres and radians."""
FINE_TIME, LOOK_TIME = 1.0, 2.5
"""Seconds for which the pose must be good to be kept, and within which it may become so: after a
push, or while people hide the map, the health of a right pose drops for a moment."""
MOVE_SPEED, MOVE_DISTANCE, MOVE_TIME, MOVE_SPARE = 0.25, 1.0, 6.0, 0.3


class Relocalise(DrivingBehaviour):
    """Find the robot's pose again: by the camera while turning in place, then by the lidar.

    A picture with a known marker gives the pose by the marker; one without is compared with the
    keyframes of the map, if it has any (`navigation: {place_recognition: {record: true}}`). Such a
    pose is accepted only if the scan fits the map there. If several poses explain
    the lidar's scans, the robot drives to where they differ (`disambiguate`); if none does, it
    drives up to a metre and searches again. Fails with AMBIGUOUS or LOST. Takes 2 s to 25 s, longer
    if places that differ are far away.
    """

    use_camera: bool = port("search for markers and known places first", default=True)
    only_if_lost: bool = port(
        f"do nothing if within {LOOK_TIME:g} s the health stays at good_health or more for "
        f"{FINE_TIME:g} s, without rival poses",
        default=False,
    )
    min_fit: float = port(
        "least fit of the scan to the map at a pose from a picture",
        default=0.35, at_least=0.0, at_most=1.0,
    )  # fmt: skip
    min_health: float = port(
        "least localisation health that confirms the new pose",
        default=0.4,
        at_least=0.0,
        at_most=1.0,
    )
    method: str = output("source of the pose: marker, appearance, lidar, or kept if it was good")

    needs = ("lidar",)
    claims = ("base",)
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        """Prepare the search; it begins with the first tick."""
        self._trail = OdometryTrail()
        self._known: list[Hypothesis] = []
        self._source = "marker"
        self._looked_until = self.robot.time
        self._steps = self._search()

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        if self._uses_camera():
            self.robot.perception.image()  # a request keeps the camera on between two stops
        return self.advance(self._steps)

    def _search(self) -> Steps:
        """Search by camera, then by lidar; if nothing fits, move and search by lidar again."""
        if self.only_if_lost and (yield from self._is_fine()):
            return self._found("kept")
        self.stand()
        if self._uses_camera() and (yield from self._by_camera()):
            return self._found(self._source)
        if (yield from self._by_lidar()):
            return self._found("lidar")
        if self._is_ambiguous:
            return False
        yield from self._move_for_another_view()
        return (yield from self._by_lidar()) and self._found("lidar")

    @property
    def _is_ambiguous(self) -> bool:
        return self.failure is not None and self.failure.code == FailureCode.AMBIGUOUS

    def _found(self, method: str) -> bool:
        self.method = method
        self.feedback_message = f"found by {method}" if method != "kept" else "was not lost"
        return True

    def _uses_camera(self) -> bool:
        return self.use_camera and bool(self.robot.map.markers or self.robot.perception.keyframes)

    def _is_fine(self) -> Steps:
        """Stand and look whether the pose is good without a search."""
        look, fine = self.start_timer(), self.start_timer()
        while not look.is_over(LOOK_TIME) and not self.robot.localisation.estimate.ambiguous:
            if not self.robot.localisation.estimate.is_good:
                fine = self.start_timer()
            elif fine.is_over(FINE_TIME):
                return True
            yield
        return False

    def _by_camera(self) -> Steps:
        """Take pictures at stops of a full turn in place."""
        picture = yield from self._new_picture(FIRST_PICTURE)
        if picture is None:
            self.feedback_message = "no camera"
            return False
        view = picture.camera.horizontal_view
        step = min(max(STEP_SHARE * view, STEP_RANGE[0]), STEP_RANGE[1])
        turned = 0.0
        while True:
            if (yield from self._look()):
                return True
            if turned >= (LONGEST_TURN if self._known else FULL_TURN) - 1e-6:
                last = next((one for one in self._known if one.source == "marker"), None)
                return last is not None and (yield from self._try(last))
            self.feedback_message = f"looking around, turned {degrees(turned):.0f} deg"
            if not (yield from self.done(self.robot.base.spin(step, while_lost=True))):
                return False
            turned += step
            self._looked_until = self.robot.time  # pictures taken while turning do not count

    def _look(self) -> Steps:
        """Evaluate up to two pictures; the second only if the first gave a hypothesis."""
        for _ in range(2):
            picture = yield from self._new_picture(NEXT_PICTURE)
            if picture is None:
                return False
            self._evaluate(picture.stamp)
            best = self._best()
            if best is not None and (yield from self._try(best)):
                return True
            if not self._known:
                return False
        return False

    def _new_picture(self, patience: float) -> Generator[None, None, Image | None]:
        """Return the next picture that was exposed after the last one; None after `patience` s."""
        timer = self.start_timer()
        while not timer.is_over(patience):
            picture = self.robot.perception.image()
            if picture is not None and picture.stamp > self._looked_until:
                self._looked_until = picture.stamp
                return picture
            yield
        return None

    def _evaluate(self, stamp: float) -> None:
        """Add the hypotheses of a picture whose scan fit is sufficient.

        A picture without a known marker is compared with the keyframes of the map.
        """
        now, then, fit = (
            self.robot.base.odometry,
            self._trail.at(stamp),
            self.robot.localisation.fit_at,
        )
        seen = [one for one in self.robot.perception.marker_sightings() if one.stamp == stamp]
        new = [one for sighting in seen for one in hypotheses(sighting, then, now, fit)]
        if not seen:
            places = [one for one in self.robot.perception.place_sightings() if one.stamp == stamp]
            recognised = place_hypothesis(places, then, now, fit, self.min_fit)
            new = [] if recognised is None else [recognised]
        self._known = merged(self._known, [one for one in new if one.fit >= self.min_fit], now)

    def _best(self) -> Hypothesis | None:
        """Return the best hypothesis if it is certain enough and leads the others; else None."""
        if not self._known:
            return None
        best, *others = self._known
        return best if best.is_sure and (not others or best.leads(others[0])) else None

    def _try(self, hypothesis: Hypothesis) -> Steps:
        """Set the pose of a hypothesis and wait for the localisation to confirm it."""
        pose = hypothesis.pose(self.robot.base.odometry)
        self.robot.localisation.set_pose(
            pose, position_deviation=PICTURE_DEVIATION, heading_deviation=PICTURE_DEVIATION,
            source=hypothesis.source,
        )  # fmt: skip
        self._source = hypothesis.source
        if (yield from self._is_confirmed()):
            return True
        self._known = [one for one in self._known if one is not hypothesis]
        return False

    def _is_confirmed(self) -> Steps:
        timer = self.start_timer()
        while not timer.is_over(CONFIRM_WITHIN):
            self.feedback_message = f"health {self.robot.localisation.health:.2f}"
            good = self.robot.localisation.health >= self.min_health
            if good and timer.is_over(CONFIRM_AFTER):
                return True
            yield
        return False

    def _by_lidar(self) -> Steps:
        """Search the whole map; if several places look alike, drive to where they differ."""
        if not (yield from self.done(self.robot.localisation.relocalise())):
            if not self._is_ambiguous:
                return False
            if not (yield from self.done(self.robot.base.disambiguate())):
                return False
        if (yield from self._is_confirmed()):
            return True
        health = self.robot.localisation.health
        sentence = f"health {health:.2f} at the pose found, expected at least {self.min_health:g}"
        self.fail(FailureCode.LOST, sentence)
        return False

    def _move_for_another_view(self) -> Steps:
        """Drive up to a metre in the direction with most room, for another view."""
        scan = self.robot.perception.scan
        if scan is None:
            return False
        ranges = np.nan_to_num(scan.ranges.astype(np.float64), posinf=scan.range_max)
        window = max(1, round(radians(40.0) / scan.angle_increment))
        around = np.pad(ranges, (window // 2, window - 1 - window // 2), mode="edge")
        room = np.lib.stride_tricks.sliding_window_view(around, window).min(axis=1)
        direction = wrap_angle(float(scan.angles[int(np.argmax(room))]) + scan.mount.heading)
        if not (yield from self.done(self.robot.base.spin(direction, while_lost=True))):
            return False
        end, timer = self._trail.distance + MOVE_DISTANCE, self.start_timer()
        while (
            self._trail.distance < end
            and not timer.is_over(MOVE_TIME)
            and self._room() > MOVE_SPARE
        ):
            self.feedback_message = "moving for another view"
            self.robot.base.drive_for(Twist(MOVE_SPEED), TIME_TO_LIVE, while_lost=True)
            yield
        self.stand()
        return True

    def _room(self) -> float:
        """Return the free distance ahead of the footprint, metres; 0 without a scan."""
        scan, radius = self.robot.perception.scan, self.robot.base.footprint.circumscribed_radius
        return room_ahead(scan.points(), radius + 0.05) - radius if scan is not None else 0.0
