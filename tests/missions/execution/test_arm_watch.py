"""Something that nobody knew is in the way of an arm: it waits, goes on, or goes round."""

import numpy as np
import pytest
import yaml

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.navigation.capabilities import arm_motion
from tests.benchmarks.arm_picking import ContactWatch
from tests.benchmarks.arm_scenes import ROOT

HEAD = "mission: arm\nrobot: panda_table\nworld: ./world.yaml\n"


class Watched:
    """A run whose contacts are watched in each physics step."""

    def __init__(self, folder, text, **world):
        known = yaml.safe_load((ROOT / "worlds" / "bench_top.yaml").read_text("utf-8"))
        known["blocks"] += world.pop("blocks", [])
        (folder / "world.yaml").write_text(yaml.safe_dump(known | world))
        (folder / "mission.yaml").write_text(HEAD + text)
        options = RunOptions(seed=1, serve=False)
        self.run = Run(prepare(folder / "mission.yaml", options), options)
        self.messages, self.limits = [], []
        try:
            self.simulation = self.run.engine.simulation
            watch = ContactWatch(self.simulation, frozenset({0}))
            while not self.run.is_over:
                self.run.step()
                self._note()
            self.report = self.run.finish()
            self.events = self.run.engine.telemetry.recent(500)
            self.blocks = self.simulation.blocks
        finally:
            self.run.close()
        self.contacts = watch.unintended

    def _note(self):
        snapshot = self.run.engine.runtime.snapshot()
        self.messages += [node.message for node in snapshot.tree if node.message]
        self.limits += [one.text for one in snapshot.limitations]

    def told(self, kind):
        return [event.text for event in self.events if event.kind == kind]


def test_the_arm_waits_for_somebody_who_comes_into_its_way(tmp_path):
    """Somebody, 10 cm thin, comes to the middle of a slow motion at 12 s, and leaves after 17 s."""
    visitor = {"name": "visitor", "waypoints": [[1.5, 0.15], [0.78, 0.15]], "speed": 1.0,
               "radius": 0.05, "pause": 5.0, "yields": False}  # fmt: skip
    poses = [
        f"move_arm: {{pose: {{x: 55 cm, y: {y} cm, z: 20 cm}}, speed: {speed}}}"
        for y, speed in ((-35, 1.0), (45, 0.12))
    ]
    done = Watched(
        tmp_path, f"run: {{sequence: [{poses[0]}, wait: {{time: 8 s}}, {poses[1]}]}}\n",
        people=[visitor],
    )  # fmt: skip
    assert (done.report.status, done.report.reason) == ("success", "")
    assert not done.contacts
    [told, *_] = done.told("held")
    assert told.startswith(
        "stopped: the arm waits: something that the cameras see is in the way of panda_"
    )
    assert done.told("held_end")[0].startswith("no longer stopped by: obstacle, after ")
    assert any("waits for" in message and "is in the way of" in message
               for message in done.messages)  # fmt: skip


def test_the_arm_goes_round_a_thing_that_nobody_has_described(tmp_path):
    """A grey pillar in the middle of the straight motion: no colour of a block, on no map."""
    pillar = {"name": "pillar", "at": [0.50, 0.12], "size": [0.06, 0.06, 0.35],
              "elevation": 0.6, "colour": [0.5, 0.5, 0.5], "mass": 5.0}  # fmt: skip
    poses = [f"move_arm: {{pose: {{x: 50 cm, y: {y} cm, z: 25 cm}}}}" for y in (-20, 40)]
    done = Watched(tmp_path, f"run: {{sequence: [{', '.join(poses)}]}}\n", blocks=[pillar])
    assert (done.report.status, done.report.reason) == ("success", "")
    assert not done.contacts
    assert np.hypot(done.blocks[-1].position[0] - 0.5, done.blocks[-1].position[1] - 0.12) < 2e-3


@pytest.mark.slow
def test_the_motion_fails_when_its_goal_stays_occupied(tmp_path, monkeypatch):
    monkeypatch.setattr(arm_motion, "LONGEST_WAIT", 5.0)  # s; a real one of 30 s costs 20 s
    visitor = {"name": "visitor", "waypoints": [[1.5, 0.4], [0.55, 0.4]], "speed": 3.0,
               "radius": 0.1, "pause": 1000.0, "yields": False}  # fmt: skip
    motion = "move_arm: {pose: {x: 55 cm, y: 40 cm, z: 20 cm}}"
    done = Watched(
        tmp_path, f"run: {{sequence: [wait: {{time: 1 s}}, {motion}]}}\n", people=[visitor]
    )
    assert done.report.status == "failure" and not done.contacts
    assert "NO_MOTION_PLAN at the goal: panda_" in done.report.reason
    assert 6.0 <= done.report.simulated_seconds < 20.0  # 1 s, the wait of 5 s, and less than 30 s
    assert done.report.reason.endswith("something that the cameras see, for 5 s")
