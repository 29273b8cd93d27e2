"""Nodes that modifiers and `events` add to the tree."""

from __future__ import annotations

from missions.language.kinds.kind import NodeKind, Outline, Shape
from missions.trees import decorators
from missions.trees.attempts import Recover, Retry
from missions.trees.events import Event, Events

_EVENT = "{wait: 1 s}\nevents: [{slow: {when: robot.speed < 1, do: {say: a}}}]"

CONTROLS = (
    NodeKind("when", "skips its node if its condition is false at the start",
             Shape.CHILD, "⊳", Outline.HEXAGON, decorators.When,
             "{wait: 1 s, when: robot.speed > 0}", empty="its `when` was not true"),
    NodeKind("finally", "runs another node however its node ends, also when it is halted",
             Shape.CHILDREN, "⊣", Outline.HEXAGON, decorators.Finally,
             "{wait: 1 s, finally: {say: a}}", keeps="the outcome of its node",
             empty="its node has not ended"),
    NodeKind("on_failure", "turns a failure of its node into a success",
             Shape.CHILD, "⊘", Outline.HEXAGON, decorators.OnFailure,
             "{spin: 90 deg, on_failure: continue}"),
    NodeKind("while", "halts its node and fails if its condition is false",
             Shape.CHILD, "⊚", Outline.HEXAGON, decorators.While,
             "{wait: 1 s, while: robot.speed < 1}", empty="its `while` was not true"),
    NodeKind("invert", "turns the success of its node into a failure and the reverse",
             Shape.CHILD, "¬", Outline.HEXAGON, decorators.Invert, "{wait: 1 s, invert: true}"),
    NodeKind("repeat", "runs its node again after a success",
             Shape.CHILD, "⟳", Outline.HEXAGON, decorators.Repeat, "{wait: 1 s, repeat: 2}",
             keeps="the number of runs"),
    NodeKind("recover", "after a failure of its node runs the next recovery, then tries again",
             Shape.CHILDREN, "✚", Outline.OCTAGON, Recover,
             "{spin: 90 deg, recover: {attempts: 2, round_robin: [{wait: 1 s}]}}",
             keeps="the attempt and the recovery whose turn is next",
             empty="this recovery was not triggered"),
    NodeKind("retry", "tries its node again after a failure",
             Shape.CHILD, "↺", Outline.HEXAGON, Retry, "{spin: 90 deg, retry: 2}",
             keeps="the attempt"),
    NodeKind("timeout", "halts its node and fails after a time limit",
             Shape.CHILD, "◷", Outline.HEXAGON, decorators.Timeout, "{wait: 1 s, timeout: 2 s}",
             keeps="the time left"),
    NodeKind("every", "runs its node at most once in a period",
             Shape.CHILD, "◔", Outline.HEXAGON, decorators.Every, "{say: a, every: 2 s}",
             keeps="the last result"),
    NodeKind("events", "runs the first event that has fired, else the mission",
             Shape.CHILDREN, "↯", Outline.OCTAGON, Events, _EVENT, keeps="the event that runs"),
    NodeKind("event", "runs its node when its condition becomes true",
             Shape.CHILD, "↯", Outline.HOUSE, Event, _EVENT,
             keeps="since when its condition is true"),
)  # fmt: skip
