"""Addresses of nodes: number, name, path and line; suggestions for unknown ones."""

import pytest

from missions.trees.addressing import find_nodes, path_of
from missions.trees.debugging import addresses
from stack.errors import InputError
from tests.missions.mission_fakes import ran

MISSION = """
    run:
      sequence:
        - use: visit
          with: {who: a}
          name: first
        - use: visit
          with: {who: b}
          name: second
    trees:
      visit:
        in: {who: text}
        do:
          sequence:
            - act: {who: $who}
              name: knock
              retry: 2
            - say: hello
"""


@pytest.fixture
def nodes(tmp_path):
    return addresses(ran(tmp_path, MISSION).tree)


def names(nodes, text):
    by_id = {node.id: node for node in nodes}
    return [path_of(by_id, number) for number in find_nodes(nodes, text)]


@pytest.mark.parametrize(
    ("text", "paths"),
    [
        ("0", ["sequence"]),
        ("#1", ["sequence/first"]),
        ("second", ["sequence/second"]),
        ("visit", ["sequence/first", "sequence/second"]),
        ("second/knock", ["sequence/second/sequence/knock"]),
        ("second > knock", ["sequence/second/sequence/knock"]),
        ("act", ["sequence/first/sequence/knock", "sequence/second/sequence/knock"]),
        ("visit/say", ["sequence/first/sequence/say", "sequence/second/sequence/say"]),
        ("mission.yaml:4", ["sequence/first"]),
        (":7", ["sequence/second"]),
        # The action itself, not its retry, which is in the same line.
        (":15", ["sequence/first/sequence/knock", "sequence/second/sequence/knock"]),
    ],
)
def test_addresses(nodes, text, paths):
    assert names(nodes, text) == paths


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("99", "numbered 0 to"),
        ("secnd", "did you mean 'second'"),
        ("third/knock", "'knock' is at sequence/first/sequence/knock, sequence/second"),
        ("first/knok", "did you mean 'knock'"),
        (":9", "nearest are 'second' in line 7"),
        ("other.yaml:4", "did you mean|available: mission.yaml"),
    ],
)
def test_an_unknown_address_gives_suggestions(nodes, text, sentence):
    with pytest.raises(InputError, match=sentence):
        find_nodes(nodes, text)
