"""Causes that end a run whatever the robot does: operators, crashes, exceptions, battery."""

from __future__ import annotations

from missions.inspection.causes.cause import CERTAIN, Cause, Fact
from missions.inspection.causes.evidence import Evidence
from stack.types import FailureCode

EMPTY = 0.02
"""Charge below which a battery counts as empty."""

STOPS = {"abort": "aborted the mission", "estop": "sent an emergency stop"}
"""Commands that end a run, and what the operator did."""


def commanded(evidence: Evidence) -> Cause | None:
    """The operator ended it: abort, emergency stop, interrupt."""
    status, end = evidence.story.status, evidence.end
    stops = [
        event for event in evidence.told("command")
        if event.fields.get("command") in STOPS and not event.fields.get("refused")
    ]  # fmt: skip
    held = evidence.last.state == "emergency stop"
    if not stops or not (held or status in ("aborted", "interrupted")):
        if status == "interrupted":
            return _ended_by_operator("the operator interrupted the run", Fact("interrupted", end))
        return None
    last = stops[-1]
    sentence = f"the operator {STOPS[str(last.fields['command'])]}"
    pose = evidence.last.pose
    return _ended_by_operator(sentence, Fact(last.text, last.time, (pose.x, pose.y)))


def _ended_by_operator(sentence: str, fact: Fact) -> Cause:
    return Cause(
        "commanded", 1.0, sentence, (fact,),
        "nothing has to be repaired; `treepilot replay` shows what the operator saw",
    )  # fmt: skip


def crashed(evidence: Evidence) -> Cause | None:
    """The engine ended without a report, or with an internal error."""
    story = evidence.story
    if story.report is not None and story.status != "error":
        return None
    if story.report is None:
        sentence = "the run has no report: the engine was killed or crashed, or is not over"
    else:
        sentence = f"the engine ended with an error: {story.reason}"
    newest = evidence.events[-1]
    return Cause(
        "engine ended", 1.0, sentence,
        (Fact(f"the last event is: {newest.text}", newest.time),),
        "read log.txt in the run folder; look at memory and disk if the system killed it",
    )  # fmt: skip


def exception(evidence: Evidence) -> Cause | None:
    """A behaviour, controller or other plugin raised an exception."""
    failed = evidence.failed
    if failed is None or failed.code != FailureCode.EXCEPTION:
        return None
    return Cause(
        "exception", 1.0, f"{failed.name} raised an exception: {failed.message}",
        (Fact(f"{failed.where} {failed.line}", failed.time),),
        "log.txt in the run folder has the traceback; repair the behaviour or plugin it names",
    )  # fmt: skip


def battery_empty(evidence: Evidence) -> Cause | None:
    """The battery was empty."""
    charge = evidence.last.battery.charge
    if charge > EMPTY:
        return None
    shot = next(item for item in evidence.shots if item.battery.charge <= EMPTY)
    pose, first = shot.pose, evidence.shots[0]
    facts = (
        Fact(f"charge {charge:.0%}", shot.time, (pose.x, pose.y)),
        Fact(f"charge {first.battery.charge:.0%}", first.time),
    )
    return Cause(
        "battery empty", CERTAIN, "the battery was empty", facts,
        "charge earlier: an event on `battery.charge` in the mission, with `charge` or `dock`",
    )  # fmt: skip


CAUSES = (commanded, crashed, exception, battery_empty)
