"""Errors cross the pipes between processes with all that they say."""

import pickle

import pytest

from stack.errors import (
    EvaluationError,
    Finding,
    InputError,
    Mark,
    NavigationError,
    ParameterError,
    WorkerError,
)
from stack.manipulation.planner import ArmBlocked

ERRORS = (
    InputError([Finding(Mark("a.yaml", 2, 3), "E001", "wrong")]),
    InputError("wrong", "fix it"),
    ParameterError("speed", "3 is too fast", "slow down"),
    NavigationError("NO_VALID_PATH", "walls everywhere", (1.0, 2.0)),
    EvaluationError("NO_VALUE", "$x is not set"),
    WorkerError("the worker failed", "refused"),
    ArmBlocked("BLOCKED", "at the start", "panda_hand touches table"),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_survives_pickling(error):
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error) and str(copy) == str(error)
    assert vars(copy) == vars(error)
