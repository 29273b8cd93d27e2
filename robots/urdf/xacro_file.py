"""Expands xacro files (macros for URDF) with the library xacro, without ROS."""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from robots.declared import URDF
from robots.urdf.packages import PackageSearch
from stack.documents.files import note_input
from stack.errors import Finding, InputError, Mark

NAMESPACE = b"xmlns:xacro"
LONGEST_MESSAGE = 300


class _PackageMissingError(Exception):
    """A package that $(find …) names is not found."""


def is_xacro(raw: bytes) -> bool:
    """Whether a file uses xacro: its root element declares the namespace."""
    return NAMESPACE in raw


def expand(path: Path, arguments: Mapping[str, str], search: PackageSearch) -> bytes:
    """The URDF that a xacro file stands for, as the command `xacro` prints it.

    Args:
        path: of the file.
        arguments: values of its arguments.
        search: where its packages are.

    Raises:
        InputError: an expression, a file or a package in it is wrong.
    """
    import xacro  # costs 50 ms, and most robots are plain URDFs
    from xacro import substitution_args

    def find(name: str) -> str:
        folder = search.package(name)
        if folder is None:
            raise _PackageMissingError(name)
        return str(folder)

    xacro.all_includes.clear()
    names: dict[str, Any] = (
        substitution_args._eval_dict
    )  # no public way to set how packages are found
    before = substitution_args._eval_find
    substitution_args._eval_find = names["find"] = find
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            document = xacro.process_file(str(path), mappings=dict(arguments))
        text: str = document.toprettyxml(indent="  ")
        for included in xacro.all_includes:
            note_input(Path(included))
    except Exception as error:  # xacro evaluates expressions, which raise anything
        raise InputError([_finding(path, xacro.filestack, error, search)]) from None
    finally:
        substitution_args._eval_find = names["find"] = before
    return text.encode()


def _finding(
    path: Path, files: list[str | None] | None, error: Exception, search: PackageSearch
) -> Finding:
    """The finding of an error, at the innermost file that xacro was reading."""
    file = next((name for name in reversed(files or []) if name), str(path))
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, _PackageMissingError):
        cause = cause.__cause__ or cause.__context__
    if cause is not None:
        sentence = f"xacro: the package {cause.args[0]!r} is not found"
        return Finding(Mark(file), URDF, sentence, package_hint(search))
    message = " ".join(f"{error}".split())[:LONGEST_MESSAGE] or type(error).__name__
    hint = ""
    if "Undefined substitution argument" in message:
        hint = (
            "set it in the robot file: urdf: {file: …, arguments: {NAME: VALUE}}, or with"
            " `treepilot new robot --set NAME=VALUE`"
        )
    return Finding(Mark(file), URDF, f"xacro: {message}", hint)


def package_hint(search: PackageSearch) -> str:
    """What to do about a package that is not found."""
    name = search.file.name
    return (
        f"list the folder that contains it in the robot file, urdf: {{file: {name}, packages: "
        "[FOLDER]}, with `treepilot new robot --packages FOLDER`, or in the environment variable "
        "ROS_PACKAGE_PATH"
    )
