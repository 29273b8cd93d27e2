"""Detecting markers."""

from __future__ import annotations

from math import degrees

from py_trees.common import Status

from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, RobotBehaviour, output, port
from stack.robot import Task
from stack.types import FailureCode, Image, MarkerSighting, Pose2D, wrap_angle

TURN_SPEED = 0.5
"""rad/s; a camera at 5 Hz sees each direction several times."""


class DetectMarkers(RobotBehaviour):
    """Report the markers in sight: their ids, and their poses as the camera measures them.

    With `wanted`, succeeds as soon as each of these markers was seen; without, after `time` (or
    after the turn) if there was any. With `turn`, the robot turns in place meanwhile. Only markers
    of the map are detected. The poses follow from the picture and the robot's estimated pose:
    markers that are off their place on the map show an error of the pose (`largest_offset`). Fails
    with MARKER_NOT_FOUND, and with NO_IMAGE if the camera gives no picture.
    """

    wanted: list[int] = port("ids of the markers that must be seen", default=[])
    turn: float = port("angle to turn meanwhile, positive to the left", unit="rad", default=0.0)
    time: float = port("how long to look, without a turn", unit="s", default=2.0, above=0.0)
    ids: list[int] = output("of the markers that were seen, in increasing order")
    poses: list[Pose2D] = output("of these markers, map frame; the heading is out of the wall")
    distances: list[float] = output("of these markers from the camera when seen nearest", unit="m")
    largest_offset: float = output("of a measured position from that on the map", unit="m")

    needs = ("camera",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.MARKER_NOT_FOUND, FailureCode.NO_IMAGE)

    def initialise(self) -> None:
        self._timer, self._trail = self.start_timer(), OdometryTrail()
        self._newest, self._pictures = self.robot.time, 0
        self._found: dict[int, tuple[MarkerSighting, Pose2D]] = {}
        self._turning: Task | None = None
        if self.turn:
            self._turning = self.robot.base.spin(self.turn, speed=TURN_SPEED)
        self._report()

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        known = {marker.number for marker in self.robot.map.markers}
        missing = sorted(set(self.wanted) - known)
        if missing:
            return self.fail(
                FailureCode.MARKER_NOT_FOUND, f"the map has no marker {_listed(missing)}"
            )
        picture = self.robot.perception.image()
        if picture is not None and picture.stamp > self._newest:
            self._look(picture)
        if self.wanted and set(self.wanted) <= self._found.keys():
            self.feedback_message = f"markers {_listed(self.ids)} seen"
            return Status.SUCCESS
        if self._turning is not None:
            status = self.follow(self._turning)
            if status is Status.FAILURE:
                return status
            over = status is Status.SUCCESS
        else:
            over = self._timer.is_over(self.time)
        self.feedback_message = f"{len(self.ids)} markers seen"
        return self._end() if over else Status.RUNNING

    def _look(self, picture: Image) -> None:
        """Add the markers in a picture; the nearest sighting of each is kept."""
        self._newest, self._pictures = picture.stamp, self._pictures + 1
        then = self.robot.localisation.pose.compose(self._trail.since(picture.stamp).inverse())
        for sighting in self.robot.perception.marker_sightings():
            number, known = sighting.marker.number, self._found.get(sighting.marker.number)
            if sighting.candidates and (known is None or sighting.distance < known[0].distance):
                self._found[number] = sighting, _measured(sighting, then)
        self._report()

    def _report(self) -> None:
        self.ids = sorted(self._found)
        found = [self._found[number] for number in self.ids]
        self.poses = [pose for _, pose in found]
        self.distances = [sighting.distance for sighting, _ in found]
        self.largest_offset = max(
            (pose.distance_to(_mapped(sighting)) for sighting, pose in found), default=0.0
        )

    def _end(self) -> Status:
        """Return the result after the time or the turn."""
        if not self._pictures:
            return self.fail(
                FailureCode.NO_IMAGE, f"the camera gave no picture in {self._timer.elapsed:.1f} s"
            )
        seen = f"seen: {_listed(self.ids) or 'none'}"
        if self.wanted:
            missing = sorted(set(self.wanted) - self._found.keys())
            return self.fail(
                FailureCode.MARKER_NOT_FOUND, f"marker {_listed(missing)} is not in sight; {seen}"
            )
        if not self.ids:
            angle = f" in a turn of {degrees(self.turn):.0f} deg" if self.turn else ""
            return self.fail(FailureCode.MARKER_NOT_FOUND, f"no marker in sight{angle}")
        return Status.SUCCESS


def _mapped(sighting: MarkerSighting) -> Pose2D:
    """Return the pose of a marker on the map."""
    x, y, _ = sighting.marker.position
    return Pose2D(x, y, sighting.marker.heading)


def _measured(sighting: MarkerSighting, robot: Pose2D) -> Pose2D:
    """Return the pose of a marker as the picture shows it, map frame.

    The candidates are poses from which the robot would see the marker so. The two of a square
    differ in the heading; the one nearer to that of the robot is right.

    Args:
        sighting: of the marker.
        robot: estimated pose at the stamp of the picture, map frame.
    """
    best = min(
        (candidate.pose for candidate in sighting.candidates),
        key=lambda pose: abs(wrap_angle(pose.heading - robot.heading)),
    )
    return robot.compose(_mapped(sighting).relative_to(best))


def _listed(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))
