"""Arithmetic with limits: 64-bit integers, finite numbers, lists and texts of limited size.

Every function raises EvaluationError instead of a Python error, so that a wrong value is the
failure of a node and never an internal error.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from stack.errors import EvaluationError
from stack.types import FailureCode

LEAST_INT, GREATEST_INT = -(2**63), 2**63 - 1
MAX_TEXT = 10_000
"""Characters of a text that a mission computes."""
MAX_ITEMS = 10_000
"""Items of a list that a mission computes, with those of inner lists."""


def limited(number: float) -> float:
    """Return a result if it is a 64-bit integer or a finite number.

    Raises:
        EvaluationError: it is not.
    """
    if isinstance(number, int):
        if not LEAST_INT <= number <= GREATEST_INT:
            raise EvaluationError(FailureCode.OVERFLOW, "the whole number exceeds 64 bits")
    elif not isfinite(number):
        raise EvaluationError(FailureCode.OVERFLOW, "the number is too large")
    return number


def exact_float(number: int) -> float:
    """Convert a whole number for a key or port of another type of number.

    Raises:
        EvaluationError: it would become another number, as some above 2^53 do.
    """
    converted = float(limited(number))
    if converted != number:
        sentence = f"{number} cannot be stored exactly in a key or port of the type float"
        raise EvaluationError(FailureCode.OVERFLOW, sentence)
    return converted


def limited_text(text: str) -> str:
    """Return a text if it is not too long.

    Raises:
        EvaluationError: it is.
    """
    if len(text) > MAX_TEXT:
        sentence = f"the text has {len(text)} characters; at most {MAX_TEXT}"
        raise EvaluationError(FailureCode.OVERFLOW, sentence)
    return text


def limited_list(items: list[Any]) -> list[Any]:
    """Return a list if it is not too long.

    Raises:
        EvaluationError: it is.
    """
    nested = bool(items) and isinstance(items[0], list)  # all items have one type
    if len(items) > MAX_ITEMS or (nested and size(items) > MAX_ITEMS):
        raise EvaluationError(FailureCode.OVERFLOW, f"the list has more than {MAX_ITEMS} items")
    return items


def size(value: Any) -> int:
    """Return the number of values in a list and its inner lists, at most one more than allowed."""
    if not isinstance(value, list):
        return 1
    total = 0
    for item in value:
        total += size(item) if isinstance(item, list) else 1
        if total > MAX_ITEMS:
            break
    return total


def add(left: Any, right: Any) -> Any:
    """Return the sum."""
    return limited(left + right)


def subtract(left: Any, right: Any) -> Any:
    """Return the difference."""
    return limited(left - right)


def multiply(left: Any, right: Any) -> Any:
    """Return the product."""
    return limited(left * right)


def divide(left: Any, right: Any) -> Any:
    """Return the quotient, not rounded."""
    if right == 0:
        raise EvaluationError(FailureCode.DIVISION_BY_ZERO, "division by zero")
    return limited(left / right)


def remainder(left: Any, right: Any) -> Any:
    """Return the remainder of a division; it has the sign of the divisor, as in Python."""
    if right == 0:
        raise EvaluationError(FailureCode.DIVISION_BY_ZERO, "remainder of a division by zero")
    return limited(left % right)


def negative(number: Any) -> Any:
    """Return the number with the opposite sign."""
    return limited(-number)


def item_at(items: Sequence[Any], index: int) -> Any:
    """Return an item; the first one has the index 0.

    Raises:
        EvaluationError: the list has no item with this index.
    """
    if not 0 <= index < len(items):
        last = f"the last index is {len(items) - 1}" if items else "the list is empty"
        raise EvaluationError(FailureCode.OUT_OF_RANGE, f"there is no item {index}: {last}")
    return items[index]
