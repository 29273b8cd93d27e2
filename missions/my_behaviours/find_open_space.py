"""Example behaviour: find the most open place in view of the lidar."""

import numpy as np

from treepilot import Behaviour, Pose2D, Status, output, port


class FindOpenSpace(Behaviour):
    """Find the point half-way along the longest view; fails if no view reaches `at_least`."""

    at_least: float = port("shortest view worth driving to", unit="m", default=1.0, above=0.0)
    place: Pose2D = output("the open place, map frame")
    reach: float = output("length of the view towards it", unit="m")

    def update(self) -> Status:
        """Evaluate the newest scan."""
        scan = self.robot.perception.scan
        if scan is None:
            return Status.RUNNING
        ranges = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0)
        wide = np.minimum.reduce([np.roll(ranges, shift) for shift in range(-9, 10)])
        best = int(np.argmax(wide))  # the widest view, not one beam through a gap
        if wide[best] < self.at_least:
            sentence = f"the longest view is {wide[best]:.2f} m, below {self.at_least:.2f} m"
            return self.fail("NO_SPACE", sentence)
        angle, reach = float(scan.angles[best]), float(wide[best])
        ahead = Pose2D(reach / 2 * np.cos(angle), reach / 2 * np.sin(angle), angle)
        self.place, self.reach = self.robot.localisation.pose.compose(ahead), reach
        self.feedback_message = f"{reach:.1f} m of space"
        return Status.SUCCESS
