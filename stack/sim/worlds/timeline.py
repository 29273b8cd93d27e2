"""Reader of the timeline of a world file."""

from __future__ import annotations

from typing import Any

from stack.documents import Section
from stack.parameters import Declaration, suggestion
from stack.sim.worlds.values import RADIUS, SHAPE, UNKNOWN_NAME, Reading, X, Y, fields_of
from stack.sim.worlds.world import Push, Trigger, WorldEvent
from stack.types import Pose2D

ACTIONS = ("open_door", "close_door", "move_robot", "push", "battery")
BATTERY = Declaration(
    "battery", float, "new battery charge", default=None, at_least=0.0, at_most=1.0
)
PUSH_BY = (
    Declaration("dx", float, "forward, or along x of the map", "m", at_least=-10.0, at_most=10.0),
    Declaration(
        "dy", float, "to the left, or along y of the map", "m", at_least=-10.0, at_most=10.0
    ),
    Declaration("dheading", float, "anticlockwise", "rad", at_least=-3.1416, at_most=3.1416),
)


def event(reading: Reading, section: Section) -> WorldEvent | None:
    """Read one timeline entry: trigger, delay and exactly one action."""
    trigger = _trigger(section)
    action: dict[str, Any] = {}
    for key in ("open_door", "close_door"):
        node = section.node_of(key)
        if node is not None:
            action[key] = node.value
            if node.value not in reading.doors:
                hint: str = suggestion(str(node.value), reading.doors)
                sentence = f"{key}: there is no door {node.words()}"
                reading.findings.add(UNKNOWN_NAME, node.mark, sentence, hint)
    moved_to = section.node_of("move_robot")
    if moved_to is not None:
        action["move_robot"] = reading.pose_or_place(section, "move_robot", moved_to)
    if section.node.get("push") is not None:
        action["push"] = _push(section)
    if section.node.get("battery") is not None:
        action["battery"] = section.value(BATTERY)
    if len(action) != 1:
        found = " and ".join(action) or "none"
        sentence = f"a timeline entry has exactly one action, got {found}"
        hint = f"actions are {', '.join(ACTIONS)}; write one entry for each"
        reading.findings.add(SHAPE, section.node.mark, sentence, hint)
        return None
    usable = trigger is not None and None not in action.values()
    return WorldEvent(trigger, **action) if trigger is not None and usable else None


def _push(section: Section) -> Push | None:
    push = section.section("push")
    if push is None or not push.node.is_mapping:
        return None
    node = push.node_of("by", required=True)
    by = None if node is None else push.parts("by", node, PUSH_BY)
    values = fields_of(push, Push)
    push.done()
    return None if by is None else Push(Pose2D(*by), **values)


def _trigger(section: Section) -> Trigger | None:
    when = section.section("when", required=True)
    after = section.value(
        Declaration("after", float, "delay after the trigger", "s", 0.0, at_least=0.0)
    )
    if when is None or not when.node.is_mapping:
        return None
    time = when.value(Declaration("time", float, "simulated time", "s", None, at_least=0.0))
    node = when.node_of("near")
    near = None if node is None else when.parts("near", node, (X, Y, RADIUS))
    when.done()
    if node is None and when.node.get("time") is None:
        sentence = "`when` needs `time: 20 s` or `near: [x, y, radius]`, or both"
        section.findings.add(SHAPE, when.node.mark, sentence)
        return None
    return Trigger(time, None if near is None else (near[0], near[1], near[2]), after)
