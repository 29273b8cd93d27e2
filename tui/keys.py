"""Table of all keys, read by the bindings, the footer, the help screen and the tests."""

from __future__ import annotations

from dataclasses import dataclass

from textual.binding import Binding


@dataclass(frozen=True, slots=True)
class Key:
    """A key, its action and its texts.

    Attributes:
        keys: Textual's names of the key, separated by commas.
        action: action of the dashboard, with arguments, in Textual's syntax.
        label: word in the footer; empty if the key is not in the footer.
        sentence: line on the help screen; empty if the line of another key covers it.
        shown_as: the key as displayed, if that is not its name.
        everywhere: whether it works on every screen and in every widget.
    """

    keys: str
    action: str
    label: str = ""
    sentence: str = ""
    shown_as: str = ""
    everywhere: bool = False

    @property
    def shown(self) -> str:
        """The key as displayed."""
        return self.shown_as or self.keys

    def binding(self) -> Binding:
        """Return the Textual binding."""
        return Binding(
            self.keys, self.action, self.label or self.sentence, show=bool(self.label),
            key_display=self.shown, priority=self.everywhere,
        )  # fmt: skip


CONTROL_KEYS = (
    Key(
        "space,shift+space,ctrl+space,ctrl+@",
        "estop",
        "E-STOP",
        "emergency stop, on any screen; in a text ctrl+space",
        "space",
        True,
    ),
    Key("R", "release", "", "release the emergency stop"),
    Key("p", "pause", "Pause", "pause or resume the mission, or the drive to your goal"),
    Key("a", "abort", "Abort…", "abort the mission; asks first"),
    Key("e", "tune", "", "change a parameter while it runs"),
    Key("g", "goal", "", "send the robot somewhere; i: set its pose; or click the map", "g i"),
    Key("i", "stands_at"),
    Key("G", "cancel_goal", "", "cancel your goal; the mission stays paused"),
    Key("B", "disturb('drop_box')", "", "in simulation: drop a box before the robot"),
    Key("O", "disturb('move_door')", "", "in simulation: close or open the nearest door"),
    Key("L", "disturb('lift_robot')", "", "in simulation: lift the robot to a place on the map"),
    Key("D", "disturb", "", "in simulation: all that can be done to robot and world"),
    Key("less_than_sign,comma", "speed(0.5)", "", "simulate slower or faster", "< >"),
    Key("greater_than_sign,full_stop", "speed(2.0)"),
    Key("enter", "teleop_done", "", "end teleoperation; until then ←↑↓→ drive"),
    Key("shift+left", "sideways(1)"),
    Key("shift+right", "sideways(-1)"),
    Key(
        "ctrl+c",
        "interrupt",
        "",
        "end a run started here, at once; asks in `watch`",
        "ctrl+c",
        True,
    ),
)
"""Keys that command the run."""

VIEW_KEYS = (
    Key(
        "plus,equals_sign",
        "zoom(1.4)",
        "Zoom",
        "zoom in, - zooms out; the map follows the robot",
        "+",
    ),
    Key("minus", "zoom(0.714)"),
    Key("f", "fit", "Fit", "show the whole map"),
    Key("left", "pan(-1,0)", "", "move the map, or select a node in the tree", "←↑↓→"),
    Key("right", "pan(1,0)"),
    Key("up", "pan(0,1)"),
    Key("down", "pan(0,-1)"),
    Key("c", "costs", "Costs", "show or hide the costmap"),
    Key("slash", "search", "", "search the events; in help and lists, filter the lines", "/"),
    Key("t", "follow_tree", "", "let the tree follow the running node"),
    Key("l", "level", "Log", "event log: info, warnings, errors, everything"),
    Key("1", "focus_pane('tree')", "", "focus tree, map, vitals, events, charts", "1-5"),
    Key("2", "focus_pane('map')"),
    Key("3", "focus_pane('vitals')"),
    Key("4", "focus_pane('events')"),
    Key("5", "focus_pane('charts')"),
    Key("H", "sheet('health')", "", "health: rates, compute time, memory, links, records"),
    Key("P", "sheet('plots')", "", "plots of any numbers over 10 s to 10 min"),
    Key("C", "sheet('camera')", "", "the camera's newest picture, with detections"),
    Key("T", "theme", "", "colours: dark, light, the terminal's 16, none"),
    Key("z", "zoom_pane", "Full", "focused pane on the full screen, on or off"),
    Key("escape", "all_panes", "", "show all panes", "esc"),
    Key("ctrl+l", "redraw", "", "draw the whole screen again"),
    Key("question_mark", "help", "Help", "this page", "?"),
    Key("q", "leave", "Quit", "leave; asks while the mission runs"),
    Key("ctrl+q", "leave", everywhere=True),
)
"""Keys that change what is shown."""

KEYS = (*CONTROL_KEYS, *VIEW_KEYS)
"""Keys of the dashboard of a live run."""

DRAFT_KEYS = (
    Key("enter", "confirm_draft", "", "drive to the placed pose, or set the robot's pose to it"),
    Key("left", "move_draft(-1,0)", "", "move it", "←↑↓→"),
    Key("right", "move_draft(1,0)"),
    Key("up", "move_draft(0,1)"),
    Key("down", "move_draft(0,-1)"),
    Key("left_square_bracket", "turn_draft(1)", "", "turn it by 15°", "[ ]"),
    Key("right_square_bracket", "turn_draft(-1)"),
    Key("g", "draft_kind('set_goal')", "", "it is a goal; i: it is where the robot stands", "g i"),
    Key("i", "draft_kind('set_pose')"),
    Key("escape", "drop_draft", "", "give it up", "esc"),
)
"""Keys of the map while a pose is being placed; they replace the same keys of the dashboard."""

FOUND_KEYS = (
    Key("n", "next_match(-1)", "", "the match before; N: the one after", "n N"),
    Key("N", "next_match(1)"),
    Key("escape", "end_search", "", "end the search", "esc"),
)
"""Keys of the events while something is searched; they replace the same keys of the dashboard."""

SHEET_KEYS = (Key("escape,H,P,C", "close", "", "back to the panes", "esc"),)
"""Keys of health, plots and camera."""

PLOT_KEYS = (
    Key("plus,equals_sign", "span(-1)", "", "less time; - shows more", "+ -"),
    Key("minus", "span(1)"),
    Key("slash", "filter", "", "list only numbers with a text in their name", "/"),
)
"""Further keys of the plots; enter plots a number, or no longer."""

PLACE_KEYS = (
    Key("up", "choose(-1)", "", "choose a place; enter takes it, or the typed coordinates", "↑↓"),
    Key("down", "choose(1)"),
    Key("escape", "cancel", "", "no place", "esc"),
)
"""Keys of the dialog for a place; letters filter the places."""

PICKER_KEYS = (
    Key("ctrl+e", "experts", "", "list those for experts too, on or off", everywhere=True),
    Key("ctrl+s", "save", "", "save the changed ones as a parameter file", everywhere=True),
    Key("escape", "back", "", "leave the value, then the list", "esc"),
    Key("up", "choose(-1)", "", "choose a parameter; enter types its new value", "↑↓"),
    Key("down", "choose(1)"),
    Key("pageup", "choose(-10)"),
    Key("pagedown", "choose(10)"),
)
"""Keys of the parameter list; letters filter it."""

TREE_KEYS = (
    Key("b", "breakpoint", "Break"),
    Key("n", "step", "Step"),
    Key("f", "force", "Force"),
    Key("c", "continue", "Continue"),
)
"""Keys of the tree; while it has the focus they replace the same keys of the dashboard."""

TREE_SENTENCE = "in the tree (1): breakpoint, one tick, force outcome, continue"
"""Line on the help screen for these keys."""
