"""Base classes of components: what they check, and the errors for classes that do not fit."""

import sys
from dataclasses import dataclass
from types import ModuleType

import pytest

from stack.components import Controller, Planner, choose, component
from stack.errors import InputError, ParameterError
from stack.parameters import parameter
from stack.plugins import named_class
from stack.types import STANDSTILL


@dataclass(frozen=True)
class Settings:
    """One parameter."""

    gain: float = parameter(1.0, above=0.0, help="gain")


class Duck:
    """Has all methods of a planner and of a controller, but no base class."""

    Parameters = Settings

    def __init__(self, parameters, robot, period=0.05):
        self.parameters = parameters

    def plan(self, costs, start, goal):
        raise NotImplementedError

    def set_segment(self, segment):
        raise NotImplementedError

    def step(self, state):
        return STANDSTILL


class Bare(Planner):
    """Has no parameters."""

    def plan(self, costs, start, goal, options=None):
        raise NotImplementedError


class Beeline(Bare):
    """A planner as it should be."""

    Parameters = Settings


class KeywordOnly(Beeline):
    """Cannot be created with (parameters, robot)."""

    def __init__(self, *, parameters, robot):
        super().__init__(parameters, robot)


class Unfinished(Controller):
    """Does not implement `step`."""

    Parameters = Settings

    def set_segment(self, segment):
        raise NotImplementedError


@pytest.fixture(autouse=True)
def plugin(monkeypatch):
    module = ModuleType("some_plugin")
    for cls in (Duck, KeywordOnly, Unfinished, Bare, Beeline):
        setattr(module, cls.__name__, cls)
    monkeypatch.setitem(sys.modules, "some_plugin", module)


@pytest.mark.parametrize(("kind", "name", "reason"), [
    ("planner", "Duck", "it does not inherit treepilot.Planner; "
                        "write `class Duck(Planner):`"),
    ("controller", "Duck", "it does not inherit treepilot.Controller; "
                           "write `class Duck(Controller):`"),
    ("planner", "Unfinished", "it does not inherit treepilot.Planner; "
                              "write `class Unfinished(Planner):`"),
    ("controller", "Unfinished", "it does not implement step"),
    ("planner", "Bare", "it has no `Parameters`"),
])  # fmt: skip
def test_a_class_that_does_not_fit_is_an_error_that_says_what_to_write(kind, name, reason):
    with pytest.raises(InputError) as caught:
        component(kind, f"some_plugin:{name}")
    assert str(caught.value).endswith(f"cannot be used: {reason}")


def test_a_plugin_that_ends_python_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "ends_python.py").write_text("raise SystemExit('bye')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match="the driver 'mine' cannot be used: bye"):
        named_class("driver", "mine", "treepilot.none", {"mine": "ends_python:Mine"}, object)


def test_a_constructor_that_does_not_accept_the_arguments_is_an_input_error():
    choice = choose("planner", "some_plugin:KeywordOnly", {})
    with pytest.raises(InputError, match=r"cannot be created: .* 1 positional argument"):
        choice.create(None)


def test_a_planner_without_a_route_graph_refuses_edges():
    made = choose("planner", "some_plugin:Beeline", {"gain": 2.0}).create(None)
    assert made.parameters.gain == 2.0 and not made.has_route_graph
    with pytest.raises(ParameterError, match="the planner in use has no route graph"):
        made.with_edge("ab", closed=True)
