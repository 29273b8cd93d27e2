"""The record of a step: what it loses when the estimate jumps, and what live settings change."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from stack.types import Perceived, Pose2D, PoseEstimate, TrackedObject, WorldView
from stack.types.perceived import JUMP_ANGLE, JUMP_DISTANCE
from tests.missions.execution.live_run import LiveRun

WORLD = """
world: hall
bounds: [-0.5, -0.5, 12.5, 8.5]
start: [2, 4, 0]
walls:
  - {points: [[0, 0], [12, 0], [12, 8], [0, 8]], closed: true}
people:
  - {name: Ada, waypoints: [[5, 7], [5, 1]], speed: 0.8 m/s}
"""
HEAD = "mission: look\nrobot: scout\nworld: hall.yaml\nstart: [2, 4, 0]\n"
LOOK = "run:\n  wait: 60 s\n"
DRIVE = "run:\n  navigate_to_pose: {goal: [8, 4, 0]}\n"

WALKER = TrackedObject(1, 5.0, (3.0, 1.0), (1.0, 0.0), 0.3, np.eye(4))


@pytest.fixture
def hall(tmp_path, live_run):
    (tmp_path / "hall.yaml").write_text(WORLD, "utf-8")

    def begin(text: str) -> LiveRun:
        run = live_run(tmp_path, text, head=HEAD)
        for _ in range(200):
            run.steps()
            if run.runtime.perceived.world.tracks:
                return run
        raise AssertionError("nobody was tracked within 10 s")

    return begin


class Seen:
    """Records the tracks that parts of the loop receive in each step."""

    def __init__(self, run: LiveRun) -> None:
        parts = run.runtime.parts
        self.remembered, self.searched, self.navigated = [], [], []
        memory, objects, step = (
            parts.perceiver.obstacle_memory,
            parts.perceiver.objects,
            parts.navigator.step,
        )
        update, search = memory.update, objects.update

        def remember(observation, frames, depth, tracks):
            self.remembered.append(tuple(tracks))
            return update(observation, frames, depth, tracks)

        def look(observation, frames, obstacles, tracks):
            self.searched.append(tuple(tracks))
            return search(observation, frames, obstacles, tracks)

        def navigate(perceived):
            self.navigated.append(perceived)
            return step(perceived)

        memory.update, objects.update, parts.navigator.step = remember, look, navigate


def set_pose(run: LiveRun, pose: Pose2D) -> None:
    run.runtime.parts.robot.localisation.set_pose(
        pose, position_deviation=0.1, heading_deviation=0.1, source="marker"
    )


def in_next_tick(run: LiveRun, act) -> None:
    """Do something as a behaviour does it: in the tick of the tree."""
    tree, tick = run.runtime.parts.tree, run.runtime.parts.tree.tick

    def once():
        tree.tick = tick
        tick()
        act()

    tree.tick = once


def test_after_a_jump_between_two_steps_nobody_gets_the_tracks_of_the_old_pose(hall):
    run = hall(LOOK)
    seen = Seen(run)
    set_pose(run, Pose2D(8.0, 4.0, pi))
    run.steps()
    assert seen.remembered == seen.searched == [()]


def test_after_a_jump_in_a_tick_neither_the_tree_nor_the_navigator_gets_them(hall):
    run = hall(LOOK)
    seen, perception = Seen(run), run.runtime.parts.robot.perception

    def jump():
        assert perception.tracks
        set_pose(run, Pose2D(8.0, 4.0, pi))
        assert perception.tracks == () == perception.standing_objects

    in_next_tick(run, jump)
    while not seen.navigated or seen.navigated[-1].estimate.pose.x < 7.0:
        run.steps()
    assert seen.navigated[-1].world.tracks == ()
    assert seen.navigated[-1].world.moving.shape == (1, 5)  # relative to the robot, for safety
    assert run.snapshot.tracks == ()
    run.steps()
    assert seen.remembered[-1] == seen.searched[-1] == ()


def test_a_jump_clears_the_costmaps_before_the_navigator_plans_on_them(hall):
    run = hall(LOOK)
    model, seen, cleared = run.runtime.parts.perceiver.world_model, Seen(run), []
    for costmap in (model.local_costmap, model.global_costmap):
        costmap.clear = lambda: cleared.append(len(seen.navigated))
    in_next_tick(run, lambda: set_pose(run, Pose2D(8.0, 4.0, pi)))
    while not cleared:
        run.steps()
    assert cleared == [len(seen.navigated) - 1] * 2
    assert seen.navigated[-1].estimate.pose.x == 8.0


def test_a_jump_while_the_simulation_is_frozen_clears_the_costmaps_on_display(hall):
    run = hall(LOOK)
    model, cleared = run.runtime.parts.perceiver.world_model, []
    run.runtime.pause("a look around")
    run.steps(20)
    assert run.runtime.is_frozen
    for costmap in (model.local_costmap, model.global_costmap):
        costmap.clear = lambda: cleared.append(run.runtime.is_frozen)
    set_pose(run, Pose2D(8.0, 4.0, pi))
    run.steps()
    assert cleared == [True, True]


def test_a_small_correction_keeps_what_was_sensed(hall):
    run = hall(LOOK)
    seen, pose = Seen(run), run.runtime.parts.robot.localisation.pose
    set_pose(run, Pose2D(pose.x + 0.1, pose.y, pose.heading))
    run.steps()
    assert len(seen.remembered[-1]) == 1 and len(seen.navigated[-1].world.tracks) == 1


def test_who_walks_is_an_obstacle_from_the_step_on_in_which_evasion_is_switched_off(hall):
    run = hall(DRIVE)
    world = run.runtime.perceived.world
    assert len(world.tracks) == len(world.evaded) == 1
    run.runtime.parts.live_parameters.change("evasion.when", "never")
    run.steps()
    world = run.runtime.perceived.world
    assert len(world.tracks) == 1 and world.evaded == ()
    run.runtime.parts.live_parameters.change("evasion.when", "always")
    run.steps()
    assert len(run.runtime.perceived.world.evaded) == 1


def test_there_are_tracks_when_nothing_needed_them_at_the_start(tmp_path):
    """Evasion and prediction can be switched on while the mission runs."""
    (tmp_path / "hall.yaml").write_text(WORLD, "utf-8")
    off = "navigation: {evasion: {when: never}, safety: {predict_motion: false}}\n"
    run = LiveRun(tmp_path, DRIVE, head=HEAD + off)
    run.steps(20)
    run.runtime.parts.live_parameters.change("evasion.when", "always")
    run.steps(100)
    assert len(run.runtime.perceived.world.evaded) == 1
    run.close()


@given(
    distance=st.floats(0.0, 2.0), turn=st.floats(-pi, pi), driven=st.floats(0.0, 5.0)
)  # fmt: skip
def test_a_record_keeps_its_tracks_exactly_until_a_jump_that_misplaces_them(distance, turn, driven):
    """The way that odometry has measured since is no jump."""
    drift = Pose2D(4.0, -1.0, 0.7)
    before = PoseEstimate(Pose2D(1.0, 2.0, 0.0), np.eye(3), 1.0, map_from_odom=drift)
    odometry = drift.inverse().compose(Pose2D(1.0 + driven, 2.0, 0.0))
    pose = Pose2D(1.0 + driven + distance, 2.0, turn)
    after = replace(before, pose=pose, map_from_odom=pose.compose(odometry.inverse()))
    moving = np.array([[2.0, -1.0, 1.0, 0.0, 0.3]])
    record = Perceived(5.0, before, world=WorldView((WALKER,), moving, 0.4, (), (WALKER,)))
    found = record.at(after)
    assume(abs(distance - JUMP_DISTANCE) > 1e-9 and abs(abs(turn) - JUMP_ANGLE) > 1e-9)
    far = distance > JUMP_DISTANCE or abs(turn) > JUMP_ANGLE
    kept = () if far else (WALKER,)
    assert found.estimate is after
    assert found.world.tracks == found.world.evaded == kept
    assert found.world.moving is moving and found.world.speed_limit == 0.4
