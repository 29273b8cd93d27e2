"""A pose that is being placed on the map: by press and drag of the mouse, or by keys."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, sin

import numpy as np

from stack.types import Pose2D, wrap_angle
from tui.drawing import palette
from tui.drawing.canvas import Canvas, arrow
from tui.panes.banner import Notice
from tui.places import pose_words

TURN = pi / 12.0
"""Angle of one press of a key, rad."""

ARM_DOTS = 10
"""Length of the line that shows the heading, in braille dots."""


QUESTIONS = {
    "set_goal": ("⚑ DRIVE HERE?", " · i: it is here"),
    "set_pose": ("◎ IS THE ROBOT HERE?", " · g: drive here"),
    "lift_robot": ("⇧ LIFT THE ROBOT HERE?", ""),
}
"""What the banner asks by kind of command, and the key for another kind."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A pose that is being placed.

    Attributes:
        kind: the command that it becomes: set_goal | set_pose | lift_robot.
        pose: map frame.
    """

    kind: str
    pose: Pose2D

    def moved(self, right: float, up: float) -> Draft:
        """Moved by metres."""
        return replace(self, pose=Pose2D(self.pose.x + right, self.pose.y + up, self.pose.heading))

    def turned(self, turns: float) -> Draft:
        """Turned anticlockwise by multiples of TURN."""
        heading = wrap_angle(self.pose.heading + turns * TURN)
        return replace(self, pose=Pose2D(self.pose.x, self.pose.y, heading))

    def facing(self, x: float, y: float, least: float) -> Draft:
        """With its heading towards a point that is at least some metres away."""
        dx, dy = x - self.pose.x, y - self.pose.y
        if hypot(dx, dy) < least:
            return self
        return replace(self, pose=Pose2D(self.pose.x, self.pose.y, atan2(dy, dx)))

    @property
    def notice(self) -> Notice:
        """What the banner asks."""
        headline, other = QUESTIONS[self.kind]
        keys = f"enter: yes{other} · ←↑↓→ move · [ ] turn · esc: no"
        return Notice("warn", headline, pose_words(self.pose), keys)

    def draw(self, canvas: Canvas) -> None:
        """Draw the place and its heading."""
        colour = palette.GOAL if self.kind == "set_goal" else palette.PARTICLE
        length = ARM_DOTS * canvas.view.metres_per_dot
        x, y, heading = self.pose.x, self.pose.y, self.pose.heading
        end = (x + length * cos(heading), y + length * sin(heading))
        canvas.draw_line(np.array([(x, y), end]), colour)
        canvas.draw_text(x, y, arrow(self.pose), palette.BACKDROP, colour)
