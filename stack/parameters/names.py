"""Names that users write: the most similar known one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

from stack.errors import Hint

NONE = "none are available"


def did_you_mean(word: str) -> Hint:
    """Hint that suggests a word in place of the one at the finding."""
    return Hint(f"did you mean {word!r}?", word)


def write(text: str, more: str = "") -> Hint:
    """Hint that tells what to write in place of the value at the finding.

    Args:
        text: the new value.
        more: of the sentence, behind it.
    """
    return Hint(f"write {text}{more}", text)


def suggestion(word: str, known: Iterable[str]) -> Hint:
    """Hint for an unknown word: the most similar word, or all known words."""
    names = sorted(set(known))
    only = names[0] if len(names) == 1 else ""
    return likely(word, names) or Hint(f"available: {', '.join(names)}" if names else NONE, only)


def superfluous(word: str, known: Iterable[str]) -> Hint:
    """Hint for an unknown key: the most similar one; else to remove it, with all known ones."""
    names = sorted(set(known))
    others = f"; available: {', '.join(names)}" if names else ""
    return likely(word, names) or Hint(f"remove it{others}")


def likely(word: str, known: Iterable[str]) -> Hint:
    """Hint for an unknown word: the most similar word; "" if none is similar."""
    close = nearest(word, sorted(known))
    return Hint() if close is None else did_you_mean(close)


def nearest(word: str, known: Sequence[str]) -> str | None:
    """The known name most similar to a misspelt word; None if none is similar.

    A unique prefix takes precedence: `init` gives `initial`, not `unit`.
    """
    longer = [name for name in known if len(word) > 2 and name.startswith(word)]
    if len(longer) == 1:
        return longer[0]
    return next(iter(get_close_matches(word, sorted(known), n=1, cutoff=0.6)), None)
