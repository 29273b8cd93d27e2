"""Search for an object of a colour, or of a label of the object detector."""

from __future__ import annotations

from math import atan2, hypot, pi

from py_trees.common import Status

from behaviours._motion.driving import DrivingBehaviour, Steps
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours._sensing.object_watch import ObjectWatch, SeenObject, WantedObject
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import (
    OBJECT_COLOURS,
    FailureCode,
    Frontier,
    Pose2D,
)

FULL_TURN = 2.0 * pi + 0.4
"""Radians; the camera needs a moment for its first picture."""

LOOK_AGAIN = 3
"""Tries of views that cannot be reached, one after the other, before the search is given up."""

GAIN_EXPONENT, DETOUR = 0.5, 2.0
"""Of the area in view, which is divided by the way and these metres."""


class FindObject(DrivingBehaviour):
    """Search the map for an object on the floor, of a colour or of a label of the object detector.

    Turns round once; then drives to places from which most of the unsearched floor is in view, and
    turns round there, until two pictures show the object at the same place. It also looks during
    the drives. Fails with OBJECT_NOT_FOUND after the whole reachable map was in view, and with
    NO_IMAGE if the camera stops.
    """

    colour: str | None = port("colour of the object", default=None, one_of=OBJECT_COLOURS)
    label: str | None = port(
        "instead of a colour: what it is, a label of the object detector", default=None
    )
    reach: float = port(
        "distance at which the object is recognised", unit="m", default=4.0, at_least=0.5,
        at_most=20.0,
    )  # fmt: skip
    turn_speed: float = port(
        "speed of the turns", unit="rad/s", default=0.8, above=0.0, at_most=3.0
    )
    least_gain: float = port(
        "places that show less unsearched floor, m², are left out", default=0.5, at_least=0.0
    )
    object: Pose2D = output("where it is, map frame; the heading is that of the line of sight")
    distance: float = output("from the robot to the object", unit="m")
    places: int = output("places from which the robot looked round")
    path_length: float = output("distance driven", unit="m")

    needs = ("camera",)
    label_port = "label"
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.NO_IMAGE)

    def initialise(self) -> None:
        """Prepare the search; it begins with the first tick."""
        self._wanted = WantedObject(self.colour, self.label)
        self._watch = ObjectWatch(self.robot, self._wanted, self.start_timer())
        self._trail = OdometryTrail()
        self._looked: list[Pose2D] = []
        self._avoided: list[Pose2D] = []
        self._found: SeenObject | None = None
        self.places, self.path_length = 0, 0.0
        self._steps = self._search()

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        self.path_length = self._trail.distance
        found = self._watch.update()
        if found:
            return self._report(found[0])
        if self._watch.is_blind:
            return self.fail(FailureCode.NO_IMAGE, self._wanted.silence)
        return self.advance(self._steps)

    def _report(self, found: SeenObject) -> Status:
        here = self.robot.localisation.pose
        dx, dy = found.x - here.x, found.y - here.y
        self.object = Pose2D(found.x, found.y, atan2(dy, dx))
        self.distance = hypot(dx, dy)
        self.failure = None
        self.feedback_message = f"{self._wanted} at ({found.x:.2f}, {found.y:.2f})"
        return Status.SUCCESS

    def _search(self) -> Steps:
        """Look round here and at the best views; ends with the failure set."""
        failures = 0
        while True:
            if failures == 0:
                yield from self._look_round()
                if self.failure is not None:
                    return False
            view = self._best_view()
            if view is None or failures >= LOOK_AGAIN:
                break
            x, y = view.middle
            self.failure = None
            reached = yield from self.done(
                self.robot.base.navigate_to(view.pose),
                f"to look at ({x:.1f}, {y:.1f}), {view.gain:.0f} m² unsearched",
            )
            self._avoided.append(view.pose)  # what it did not show is not shown from there
            failures = 0 if reached else failures + 1
            if self._is_lost:
                return False
        self.fail(
            FailureCode.OBJECT_NOT_FOUND,
            f"no {self._wanted} within {self.reach:g} m of {self.places} places",
        )
        return False

    @property
    def _is_lost(self) -> bool:
        """Whether the last motion failed because the robot does not know where it is."""
        codes = FailureCode.LOST, FailureCode.AMBIGUOUS
        return self.failure is not None and self.failure.code in codes

    def _look_round(self) -> Steps:
        task = self.robot.base.spin(FULL_TURN, speed=self.turn_speed)
        self.failure = None
        yield from self.done(task, f"looking round, place {self.places + 1}")
        if not self._is_lost:
            self.failure = None  # a turn that is blocked has shown what it could
            self._looked.append(self.robot.localisation.pose)
            self.places = len(self._looked)
        return True

    def _best_view(self) -> Frontier | None:
        views = self.robot.map.frontiers(
            sensor_range=self.reach, least_gain=self.least_gain, avoided=self._avoided,
            seen_from=self._looked,
        )  # fmt: skip
        return max(views, key=_worth, default=None)


def _worth(view: Frontier) -> float:
    return float(view.gain**GAIN_EXPONENT / (view.distance + DETOUR))
