"""The log says exactly when each order took effect: obeyed again then, the run is the same."""

from stack.telemetry.records import Command, MissionState
from tests.missions.execution.live_run import LiveRun

MISSION = """
    blackboard: {n: {type: int, initial: 0}}
    run:
      sequence:
        - navigate_to_pose: {goal: [2.5, 1.0, 0]}
          name: out
        - set: {n: $n + 1}
        - navigate_to_pose: {goal: [1.0, 1.0, 0]}
          name: back
          recover: {attempts: 2, round_robin: [{wait: {time: 0.2 s}}]}
"""


def debugged(folder):
    """A run in which an operator does a lot, at arbitrary moments."""
    run = LiveRun(folder, MISSION)
    run.steps(17)
    run.order("break", node="set")
    run.order("pause")
    run.steps(9)
    run.order("step", ticks=4)
    run.steps(30)
    run.order("continue")
    run.until("breakpoint")
    run.order("force", node="back", status="failure", code="NO_PROGRESS")
    run.order("step")
    run.steps(25)
    run.order("resume")
    run.order("pause")  # at once, in the step after
    run.steps(12)
    run.order("force", node="back", status="off")
    run.order("continue")
    run.until("mission_ended")
    run.close()
    return run


class Obeying(LiveRun):
    """Takes its orders from another run's log."""

    def follow(self, events):
        self.left = [event for event in events if event.kind == "command"]
        self.kept.commands = self.due

    def due(self):
        now = (self.runtime.steps, self.runtime.is_frozen)
        found = []
        while self.left and (self.left[0].step, self.left[0].fields["held"]) == now:
            event = self.left.pop(0)
            found.append(Command("again", event.fields["command"], event.fields["arguments"]))
        return found


def test_obeying_the_logged_orders_again_gives_the_same_log(tmp_path):
    first = debugged(tmp_path / "first")
    assert first.runtime.state is MissionState.SUCCESS
    assert len(first.texts("command")) == 10
    again = Obeying(tmp_path / "again", MISSION)
    again.follow(first.kept.events)
    again.until("mission_ended", within=2000)
    again.close()
    assert again.texts() == first.texts()
    assert again.telemetry.log_sha256 == first.telemetry.log_sha256


def test_a_node_is_reached_at_the_same_pose_with_and_without_a_breakpoint(tmp_path):
    """Standing at a breakpoint costs one tick and a stop, not the mission's course."""
    poses = []
    for name, breakpoints in (("plain", ()), ("broken", ("set",))):
        run = LiveRun(tmp_path / name, MISSION, breakpoints=breakpoints)
        while run.runtime.state is not MissionState.PAUSED and "set: idle > success" not in (
            run.texts("node_status")
        ):
            run.steps()
        poses.append(run.snapshot.pose)
        run.close()
    assert poses[0].distance_to(poses[1]) < 0.02
