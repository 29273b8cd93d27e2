"""Every key in one table: the bindings, the footer, the help screen and the tests all read it."""

from __future__ import annotations

from dataclasses import dataclass

from textual.binding import Binding


@dataclass(frozen=True, slots=True)
class Key:
    """One key: what it does, in the footer's word and in a sentence.

    Attributes:
        keys: Textual's names, separated by commas.
        action: method of the dashboard, with arguments, as Textual writes it.
        label: word in the footer; empty keeps it out of the footer.
        sentence: line on the help screen; empty when the line of another key covers it.
        shown_as: how people write the key, where that is not its name.
        everywhere: works whatever screen or widget has the focus.
    """

    keys: str
    action: str
    label: str = ""
    sentence: str = ""
    shown_as: str = ""
    everywhere: bool = False

    @property
    def shown(self) -> str:
        """How people write the key."""
        return self.shown_as or self.keys

    def binding(self) -> Binding:
        """As Textual wants it."""
        return Binding(
            self.keys, self.action, self.label or self.sentence, show=bool(self.label),
            key_display=self.shown, priority=self.everywhere,
        )  # fmt: skip


KEYS = (
    Key("space", "estop", "E-STOP", "stop at once, on any screen; nothing is asked", "space", True),
    Key("R", "release", "", "release the emergency stop"),
    Key("p", "pause", "Pause", "pause, and again to go on; the robot stands meanwhile"),
    Key("a", "abort", "Abort…", "end the mission; asks first"),
    Key("e", "tune", "", "change a parameter while it runs"),
    Key("g", "goal", "", "send the robot to a place; i says at which place it stands", "g i"),
    Key("i", "stands_at"),
    Key("less_than_sign,comma", "speed(0.5)", "", "simulate slower or faster", "< >"),
    Key("greater_than_sign,full_stop", "speed(2.0)"),
    Key(
        "plus,equals_sign",
        "zoom(1.4)",
        "Zoom",
        "map nearer, and - farther; it follows the robot",
        "+",
    ),
    Key("minus", "zoom(0.714)"),
    Key("f", "fit", "Fit", "the whole map"),
    Key("left", "pan(-1,0)", "", "move the map, or choose a node in the tree", "←↑↓→"),
    Key("right", "pan(1,0)"),
    Key("up", "pan(0,1)"),
    Key("down", "pan(0,-1)"),
    Key(
        "enter",
        "teleop_done",
        "",
        "done driving, when a mission hands over; ←↑↓→ drive until then",
        "enter",
    ),
    Key("shift+left", "sideways(1)"),
    Key("shift+right", "sideways(-1)"),
    Key("c", "costs", "Costs", "costmap on or off"),
    Key("t", "follow_tree", "", "let the tree follow what runs"),
    Key("l", "level", "Log", "event log: info, warnings, errors, everything"),
    Key("1", "focus_pane('tree')", "", "tree, map, vitals, events, charts", "1-5"),
    Key("2", "focus_pane('map')"),
    Key("3", "focus_pane('vitals')"),
    Key("4", "focus_pane('events')"),
    Key("5", "focus_pane('charts')"),
    Key("z", "zoom_pane", "Full", "the focused pane over the whole screen, and back"),
    Key("escape", "all_panes", "", "back to all panes", "esc"),
    Key("question_mark", "help", "Help", "this page", "?"),
    Key("q", "leave", "Quit", "leave; asks while the mission runs"),
    Key("ctrl+q", "leave", everywhere=True),
    Key(
        "ctrl+c",
        "interrupt",
        "",
        "end a run begun here, at once; asks when watching",
        "ctrl+c",
        True,
    ),
)
