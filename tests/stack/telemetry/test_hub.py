import hashlib

import numpy as np
import pytest

from stack.telemetry.event_log import event_line
from stack.telemetry.hub import Telemetry
from stack.telemetry.lost_records import RecordFull
from stack.telemetry.records import Ack, Command


class Notes:
    """A sink that writes down what it is told."""

    def __init__(self, wants=True):
        self.wants, self.opened, self.closed = wants, None, []
        self.events, self.snapshots = [], []

    def open(self, info):
        self.opened = info

    def event(self, event):
        self.events.append(event)

    def wants_snapshot(self, time):
        return self.wants

    def snapshot(self, snapshot):
        self.snapshots.append(snapshot)

    def close(self, report):
        self.closed.append(report)


class Broken(Notes):
    """Fails in one method."""

    def __init__(self, where):
        super().__init__()

        def fail(*_):
            raise OSError("no space left")

        setattr(self, where, fail)


class Operator(Notes):
    """A sink with commands."""

    def __init__(self, *commands):
        super().__init__()
        self.waiting, self.acks, self.served = list(commands), [], 0

    def service(self):
        self.served += 1

    def commands(self):
        taken, self.waiting = self.waiting, []
        return taken

    def silence(self):
        return None

    def acknowledge(self, ack):
        self.acks.append(ack)


def test_events_are_numbered_and_stamped_with_the_step(info):
    sink = Notes()
    telemetry = Telemetry(info, [sink])
    telemetry.emit("started", "off we go", source="mission")
    telemetry.advance(7, 0.35)
    event = telemetry.emit(
        "replan", "the way is blocked", source="navigation", level="warning", n=2
    )
    assert (event.number, event.step, event.time, event.level) == (1, 7, 0.35, "warning")
    assert event.fields == {"n": 2}
    assert [item.number for item in sink.events] == [0, 1]
    assert telemetry.recent(1) == (event,) and telemetry.recent(0) == ()


def test_the_hash_is_that_of_the_lines(info):
    telemetry = Telemetry(info)
    events = [
        telemetry.emit("pose", "here", source="robot", pose=np.array([0.1, 1 / 3, 1e-300])),
        telemetry.emit("say", "größer", source="mission", limit=float("inf")),
    ]
    lines = b"".join(event_line(event) for event in events)
    assert telemetry.log_sha256 == hashlib.sha256(lines).hexdigest()
    assert b"0.3333333333333333," in lines and b'"limit":"inf"' in lines


def test_the_hash_sees_the_last_bit(info):
    def hashed(value):
        telemetry = Telemetry(info)
        telemetry.emit("pose", "", source="robot", x=value)
        return telemetry.log_sha256

    assert hashed(0.1) == hashed(0.1) != hashed(np.nextafter(0.1, 1.0))


def test_the_order_of_fields_does_not_matter(info):
    one, other = Telemetry(info), Telemetry(info)
    one.emit("a", "", source="s", x=1, y=2)
    other.emit("a", "", source="s", y=2, x=1)
    assert one.log_sha256 == other.log_sha256


def test_wrong_events_are_refused(info):
    telemetry = Telemetry(info)
    with pytest.raises(ValueError, match="level 'loud' is not one of info"):
        telemetry.emit("a", "", source="s", level="loud")
    with pytest.raises(TypeError, match="object is neither"):
        telemetry.emit("a", "", source="s", thing=object())
    assert telemetry.count == 0


def test_a_snapshot_is_built_once_and_only_when_wanted(info, snapshot_at):
    built = []

    def make():
        built.append(1)
        return snapshot_at()

    idle, keen, other = Notes(wants=False), Notes(), Notes()
    telemetry = Telemetry(info, [idle])
    telemetry.publish(make)
    assert built == []
    telemetry.attach(keen)
    telemetry.attach(other)
    telemetry.publish(make)
    assert built == [1] and not idle.snapshots and keen.snapshots[0] is other.snapshots[0]


@pytest.mark.parametrize("where", ["open", "event", "wants_snapshot", "snapshot", "close"])
def test_a_failing_sink_is_removed_with_one_line(where, info, snapshot_at):
    lines, healthy = [], Notes()
    telemetry = Telemetry(info, [Broken(where), healthy], lines.append)
    for _ in range(3):
        telemetry.emit("a", "", source="s")
        telemetry.publish(snapshot_at)
    telemetry.close({"result": "success"})
    assert lines[0] == "Broken failed and was removed: OSError: no space left"
    assert len(lines) == (2 if where == "close" else 1)
    assert len(healthy.events) == len(healthy.snapshots) == 3
    assert healthy.closed == [{"result": "success"}]


def test_a_late_sink_receives_the_past_events(info):
    telemetry = Telemetry(info)
    telemetry.emit("a", "", source="s")
    late = Notes()
    assert telemetry.attach(late)
    assert late.opened is info and [event.kind for event in late.events] == ["a"]


def test_close_brings_the_last_snapshot_and_works_twice(info, snapshot_at):
    idle = Notes(wants=False)
    telemetry = Telemetry(info, [idle])
    telemetry.close({"result": "x"}, lambda: snapshot_at(time=9.0))
    telemetry.close({"result": "y"})
    assert idle.snapshots[0].time == 9.0 and idle.closed == [{"result": "x"}]


def test_acks_reach_their_sender_even_with_equal_ids(info):
    first, second = Operator(Command("1", "pause")), Operator(Command("1", "resume"))
    telemetry = Telemetry(info, [Notes(), first, Broken("event"), second])
    telemetry.emit("a", "", source="s")
    telemetry.service()
    pause, resume = telemetry.commands()
    assert (pause.kind, resume.kind) == ("pause", "resume") and telemetry.commands() == []
    telemetry.acknowledge(Ack(resume.id, False, "not paused"))
    telemetry.acknowledge(Ack(pause.id, True))
    assert first.acks == [Ack("1", True)] and second.acks == [Ack("1", False, "not paused")]
    assert first.served == second.served == 1


class Record(Broken):
    """A sink that writes a file of the run folder, and fails."""

    record = "sensors.mcap"


def test_a_record_that_fails_is_lost_and_told_once(info):
    lines, warnings = [], []
    telemetry = Telemetry(info, [Record("event")], lines.append, warnings.append)
    telemetry.advance(30, 1.5)
    for _ in range(2):
        telemetry.emit("a", "", source="s")
        telemetry.lose("log.txt", "No space left on device")
    assert [record.text for record in telemetry.lost] == [
        "sensors.mcap from 1.5 s on (OSError: no space left)",
        "log.txt from 1.5 s on (No space left on device)",
    ]
    assert warnings == [f"! records lost: {record.text}" for record in telemetry.lost]
    assert lines == []


def test_a_record_at_its_limit_ends_and_is_not_lost(info):
    warnings, sink = [], Record("event")

    def full(event):
        raise RecordFull("sensors.mcap", 5e6)

    sink.event = full
    telemetry = Telemetry(info, [sink], warn=warnings.append)
    telemetry.emit("a", "", source="s")
    telemetry.emit("a", "", source="s")
    sentence = (
        "! at 0.0 s sensors.mcap reached its limit of 5 MB; the recording ends here"
        " (recording.size_limit sets the limit)"
    )
    assert warnings == [sentence] and telemetry.lost == ()
    assert sink.closed == [None]


class Link(Broken):
    """A connection with another program that fails."""

    link = "MAVLink"


@pytest.mark.parametrize("where", ["event", "wants_snapshot", "snapshot"])
def test_a_link_that_fails_is_an_event_after_the_one_at_which_it_failed(where, info, snapshot_at):
    before, after = Notes(), Notes()
    telemetry = Telemetry(info, [before, Link(where), after])
    telemetry.emit("a", "", source="s")
    telemetry.publish(snapshot_at)
    telemetry.emit("b", "", source="s")
    for sink in (before, after):
        assert [event.number for event in sink.events] == [0, 1, 2]
        assert [event.kind for event in sink.events] == ["a", "link_lost", "b"]
        lost = sink.events[1]
        assert (lost.level, lost.text) == ("warning", "MAVLink lost: OSError: no space left")


def test_a_link_that_fails_at_the_end_is_no_event(info):
    sink = Notes()
    telemetry = Telemetry(info, [sink, Link("close")])
    telemetry.close(None)
    assert sink.events == []
