"""Changes values in a YAML text and leaves everything else as it is: comments, order, layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

_Loader: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


def with_values(text: str, values: Mapping[Sequence[str], str]) -> str:
    """Return the text with values set.

    A value that is there is replaced; a key that is missing is added at the end of its mapping, in
    the layout of that mapping; a mapping that is missing is added at the end of its parent.

    Args:
        text: YAML whose document is a mapping.
        values: the new values as YAML on one line, by path: `("wheels", "radius"): "7.5 cm"`.

    Raises:
        ValueError: the text is not a mapping, or a path leads through something else.
    """
    for path, value in values.items():
        root = yaml.compose(text, Loader=_Loader)
        try:
            text = _changed(text, root, tuple(path), value)
        except TypeError as error:
            raise ValueError(f"{'.'.join(path)} cannot be set: {error}") from None
    return text


def _changed(text: str, node: Any, path: tuple[str, ...], value: str) -> str:
    """Return the text with the value at a path below a node."""
    if not isinstance(node, yaml.MappingNode):
        raise TypeError(f"{path[0]!r} has no mapping to be in")
    key, rest = path[0], path[1:]
    for name, child in node.value:
        if name.value == key:
            if rest and not _is_empty(child):
                return _changed(text, child, rest, value)
            begin, end = _offset(text, child.start_mark), _offset(text, _last(child).end_mark)
            return text[:begin] + _spaced(text, begin) + _nested(rest, value) + text[end:]
    return _added(text, node, f"{key}: {_nested(rest, value)}")


def _is_empty(node: Any) -> bool:
    return isinstance(node, yaml.ScalarNode) and node.value in ("", "null", "~")


def _spaced(text: str, at: int) -> str:
    """Return the space that must precede a value where there was none."""
    return "" if at == 0 or text[at - 1] in " \n[{" else " "


def _nested(path: tuple[str, ...], value: str) -> str:
    """Return a value inside flow mappings: ("a", "b") -> {a: {b: value}}."""
    for key in reversed(path):
        value = f"{{{key}: {value}}}"
    return value


def _added(text: str, node: Any, entry: str) -> str:
    """Return the text with an entry at the end of a mapping."""
    if node.flow_style:
        at = _offset(text, node.end_mark) - 1
        before = text[:at].rstrip()
        return before + (", " if node.value else "") + entry + text[at:]
    indent = " " * (node.value[0][0].start_mark.column if node.value else 0)
    at = _offset(text, _last(node).end_mark)
    line_end = text.find("\n", at)
    if line_end < 0:
        return f"{text}\n{indent}{entry}\n"
    return f"{text[:line_end]}\n{indent}{entry}{text[line_end:]}"


def _last(node: Any) -> Any:
    """Return the last scalar or flow collection: a block collection ends where the next begins."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        node = last[1] if isinstance(last, tuple) else last
    return node


def _offset(text: str, mark: Any) -> int:
    """Return the index of a position; libyaml and PyYAML count lines and columns alike."""
    lines = text.split("\n")
    return sum(len(line) + 1 for line in lines[: mark.line]) + int(mark.column)
