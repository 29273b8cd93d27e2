"""The tables of docs/learning.md are those of the code."""

from __future__ import annotations

from pathlib import Path

from missions.learning.rewards import Rewards
from robots.load import find_robot, read_robot
from stack.control.policy.observations import Observations
from stack.control.policy.parameters import NAMES, PolicyParameters
from stack.parameters import declarations

PAGE = (Path(__file__).parents[3] / "docs" / "learning.md").read_text("utf-8")


def rows_behind(mark):
    table = PAGE.split(f"<!-- {mark} -->\n")[1].split("\n\n")[0].splitlines()[2:]
    return [tuple(cell.strip() for cell in row.strip("|").split("|")) for row in table]


def test_observations():
    scout = read_robot(find_robot("scout", Path()))
    fields = Observations(PolicyParameters(observations=NAMES), scout).fields
    assert rows_behind("observations") == [(f"`{it.name}`", it.unit, it.help) for it in fields]


def test_rewards():
    assert rows_behind("rewards") == [
        (f"`{name}`", f"{item.default:g} {item.unit}".strip(), item.help)
        for name, item in declarations(Rewards).items()
    ]
