"""Texts of records as HTML."""

from __future__ import annotations

import re
from html import escape

from stack.types.printable import printable


def safe(words: object) -> str:
    """Return a text as HTML."""
    return escape(printable(str(words)))


def prose(words: str) -> str:
    """Return sentences as HTML; what is between backticks is code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", safe(words))
