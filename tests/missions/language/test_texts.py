"""Texts with placeholders, and trees whose `in` have defaults."""

import pytest

from stack.types import Battery, Pose2D
from tests.missions.mission_fakes import ran, read_text

HEAD = """
arguments: {dwell: {type: duration, default: 90 s}}
blackboard:
  n: {type: int, initial: 2}
  far: {type: length, initial: 1234.5}
  angle: {type: angle, initial: 90 deg}
  goals: {type: list of Pose, initial: [$lobby, [1, 2, 0]]}
  photo: {type: path, optional: true}
  open: {type: bool, initial: true}
run:
  say: """


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("visited ${n} of 3", "visited 2 of 3"),
        ("'${n}'", "2"),
        ('"say: ${n}"', "say: 2"),
        ("${n}${n} ${ n }", "22 2"),
        ("${$n + 1}", "3"),
        ("${$n / 3}", "0.667"),
        ("waits ${dwell}", "waits 90 s"),
        ("${far} to go", "1234 m to go"),
        ("${angle}", "90 deg"),
        ("at ${lobby}", "at lobby"),
        ("at ${pose}", "at [1.00, 2.00, 90 deg]"),
        ("${pose.x} ${pose.heading}", "1 m 90 deg"),
        ("${goals}", "[[9.00, 9.00, 0 deg], [1.00, 2.00, 0 deg]]"),
        ("${battery.charge}", "0.335"),
        ("${open} ${'a } b'} ${$photo is set}", "true a } b false"),
        ("${robot.speed} ${time}", "0 m/s 0 s"),
        ("costs $${n} $5 {n}", "costs ${n} $5 {n}"),
    ],
)
def test_values_in_texts(tmp_path, text, said):
    it = ran(tmp_path, f"{HEAD}{text}\n")
    it.robot.battery, it.robot.pose = Battery(0.33456), Pose2D(1.0, 2.0, 1.5707963)
    it.ticks()
    assert it.robot.log == [said]


def test_placeholders_are_filled_when_the_text_is_read(tmp_path):
    it = ran(tmp_path, """
        blackboard: {n: {type: int, initial: 0}}
        run:
          sequence:
            - sequence: [{set: {n: $n + 1}}, {say: "number ${n}"}]
              repeat: 2
            - {fallback: [{act: a}, {say: "${error}"}]}
        """)  # fmt: skip
    it.robot.answers["a"] = "f"
    it.ticks(3)
    assert it.robot.log == ["number 1", "number 2", "a starts", "a failed", "NO_WALL"]


def test_a_missing_value_fails_the_node(tmp_path):
    it = ran(
        tmp_path,
        """
        blackboard: {photo: {type: path, optional: true}}
        run:
          sequence:
            - fallback: [{act: a}, {take_photo: {}, out: {image: $photo}}]
            - {say: "took ${photo}"}
        """,
    )
    it.ticks()
    assert it.tree.failure.sentence == "$photo is read, but nothing has written it yet"


TREES = """
arguments: {dwell: {type: duration, default: 4 s}}
run:
  sequence: [{use: greet}, {use: greet, with: {word: bye, pause: 200 ms}}]
trees:
  greet:
    in:
      word: {type: text, default: hello, doc: what to say}
      where: {type: Pose, default: $lobby}
      pause: {type: duration, default: $dwell}
    do: {sequence: [{say: "${word} at ${where}, ${pause}"}, {wait: 100 ms}]}
"""


def test_omitted_inputs_of_a_tree_have_their_defaults(tmp_path):
    assert read_text(tmp_path, TREES).warnings == ()
    it = ran(tmp_path, TREES)
    it.ticks(3)
    assert it.robot.log == ["hello at lobby, 4 s", "bye at lobby, 0.2 s"]
