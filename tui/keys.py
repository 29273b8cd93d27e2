"""Every key in one table: the footer, the help screen and the tests all read it."""

from __future__ import annotations

from dataclasses import dataclass

from textual.binding import Binding


@dataclass(frozen=True)
class Key:
    """One key: what it does, in the footer's word and in a sentence."""

    keys: str
    action: str
    label: str
    sentence: str
    footer: bool = True
    priority: bool = False
    shown_as: str = ""

    def binding(self) -> Binding:
        """As Textual wants it."""
        return Binding(
            self.keys, self.action, self.label, show=self.footer, priority=self.priority,
            key_display=self.shown_as or None,
        )  # fmt: skip


KEYS = (
    Key("space", "estop", "E-STOP", "stop at once, from any screen; nothing is asked", True, True),
    Key("R", "release", "Release", "release the emergency stop", False, shown_as="R"),
    Key("p", "pause", "Pause", "pause, and again to go on; the robot stands meanwhile"),
    Key("a", "abort", "Abort…", "end the mission; asks first"),
    Key("plus,equals_sign", "zoom(1.4)", "Zoom", "map nearer, following the robot", shown_as="+"),
    Key("minus", "zoom(0.714)", "Zoom out", "map farther", False, shown_as="-"),
    Key("f", "fit", "Fit", "the whole map"),
    Key("left", "pan(-1,0)", "Left", "move the map", False, shown_as="←"),
    Key("right", "pan(1,0)", "Right", "move the map", False, shown_as="→"),
    Key("up", "pan(0,1)", "Up", "move the map, or scroll the tree", False, shown_as="↑"),
    Key("down", "pan(0,-1)", "Down", "move the map, or scroll the tree", False, shown_as="↓"),
    Key("c", "costs", "Costs", "costmap on or off"),
    Key("t", "follow_tree", "Tree", "let the tree follow what runs", False),
    Key("l", "level", "Log", "event log: info, warnings, errors, everything"),
    Key("z", "zoom_pane", "Full pane", "the focused pane over the whole screen, and back"),
    Key("1,2,3,4", "focus_pane", "Panes", "go to tree, map, vitals, events", False, shown_as="1-4"),
    Key("less_than_sign", "speed(0.5)", "Slower", "simulate at half the speed", False, False, "<"),
    Key(
        "greater_than_sign",
        "speed(2.0)",
        "Faster",
        "simulate at twice the speed",
        False,
        False,
        ">",
    ),
    Key("question_mark", "help", "Help", "this page", shown_as="?"),
    Key("q,ctrl+c", "leave", "Quit", "leave; while the mission runs it asks", True, shown_as="q"),
)
