"""The analyses take time proportional to the size of a mission, counted in calls."""

import sys
from collections import Counter
from pathlib import Path

import pytest

from missions.language import analysis
from tests.missions.mission_fakes import read_text

FOLDER = str(Path(analysis.__file__).parent)


def calls_of_analysis(action):
    """How often functions of the analyses are called during an action, in all."""
    calls = Counter()

    def count(frame, event, _):
        if event == "call" and frame.f_code.co_filename.startswith(FOLDER):
            calls[frame.f_code.co_name] += 1

    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(None)
    return calls.total()


def nested_trees(number, body):
    """Trees that nothing uses; each uses the next one twice, so that the last one stands 2^n times.

    `body` makes the nodes of a tree from the word that uses the next tree.
    """
    lines = ["blackboard: {n: {type: int, initial: 0}}", "run: {say: hello}", "trees:"]
    for index in range(number):
        use = f"use: t{index + 1}"
        lines.append(f"  t{index}: {{do: {body.format(use=use)}}}")
    return "\n".join([*lines, f"  t{number}: {{do: {{set: {{n: $n + 1}}}}}}", ""])


@pytest.mark.parametrize(
    "body",
    [
        "{{reactive: [{{{use}}}, {{{use}}}]}}",
        "{{parallel: [{{{use}}}, {{{use}}}]}}",
        "{{sequence: [{{{use}}}, {{{use}}}]}}",
        "{{fallback: [{{{use}, retry: 2}}, {{{use}}}]}}",
        "{{say: a, recover: {{attempts: 2, round_robin: [{{{use}}}, {{{use}}}]}}}}",
    ],
)
def test_nested_unused_trees_cost_the_same_each(tmp_path, body):
    read_text(tmp_path, nested_trees(2, body))  # imports and caches
    small = calls_of_analysis(lambda: read_text(tmp_path, nested_trees(8, body)))
    large = calls_of_analysis(lambda: read_text(tmp_path, nested_trees(16, body)))
    assert large <= 2.1 * small  # doubling with each tree would be a factor of 256


def test_a_parallel_within_parallels_is_searched_for_writes_once(tmp_path):
    def mission(depth):
        inner = "{set: {n: $n + 1}}"
        for _ in range(depth):
            inner = f"{{parallel: [{inner}, {{say: a}}]}}"
        return f"blackboard: {{n: {{type: int, initial: 0}}}}\nrun: {inner}\n"

    small = calls_of_analysis(lambda: read_text(tmp_path, mission(8)))
    large = calls_of_analysis(lambda: read_text(tmp_path, mission(16)))
    assert large <= 2.1 * small


def test_events_are_compared_with_each_other_in_linear_time(tmp_path):
    def mission(number):
        events = [f"  - e{n}: {{when: time > {n} s, do: {{say: a}}}}" for n in range(number)]
        return "\n".join(["run: {wait: 1 s}", "events:", *events, ""])

    small = calls_of_analysis(lambda: read_text(tmp_path, mission(20)))
    large = calls_of_analysis(lambda: read_text(tmp_path, mission(40)))
    assert large <= 2.1 * small


BLOCK = """
    - sequence:
        - navigate_to_pose: [1.0, 5.0, 0]
          timeout: 60 s
          recover: {attempts: 4, round_robin: [{clear_costmap: local}, {spin: 90 deg}]}
        - {wait: 1 s, when: battery.charge > 0.2}
        - fallback:
            - {take_photo: {}, retry: 3}
            - {check: error == NO_IMAGE}
        - {use: count, repeat: 2}
        - {say: '${n}'}
"""
"""Twelve nodes, with those of the used tree."""


def patrol(blocks):
    """A mission of that many blocks."""
    head = "blackboard: {n: {type: int, initial: 0}}\nrun:\n  sequence:"
    tail = "trees:\n  count: {do: {sequence: [{set: {n: $n + 1}}, {wait: 1 s, when: $n > 3}]}}\n"
    return head + BLOCK * blocks + tail


def test_a_large_mission_costs_as_much_per_node_as_a_small_one(tmp_path):
    read_text(tmp_path, patrol(1))
    small = calls_of_analysis(lambda: read_text(tmp_path, patrol(40)))
    large = calls_of_analysis(lambda: read_text(tmp_path, patrol(80)))
    assert large <= 2.1 * small
