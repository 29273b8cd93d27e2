"""Trial of a model in a process of its own: OpenCV can crash on a damaged file.

Of 300 copies of a model with one to three flipped bits, 8 crashed OpenCV's importer and 133 were
refused with a reason. A mission is therefore checked by a child process that loads the model and
runs it once; `python -m stack.perception.objects.trial` is that child.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

from stack.child_process import run_module
from stack.errors import InputError
from stack.parameters import suggestion
from stack.perception.objects.parameters import ObjectDetectorParameters

LONGEST = 120.0
"""Wall seconds after which a trial is given up."""


def checked_labels(parameters: ObjectDetectorParameters) -> tuple[str, ...]:
    """Try a model; return its labels. Unchanged files are tried once.

    Raises:
        InputError: as `ObjectModel`; the model crashes; or `only` has a label that the model does
            not have.
    """
    files = [Path(name) for name in (parameters.model, parameters.label_file) if name]
    labels, problem = _tried(_of_model(parameters), tuple(map(version_of, files)))
    if problem:
        raise InputError(problem)
    for label in parameters.only:
        if label not in labels:
            raise InputError(
                f"only: {parameters.model} has no label {label!r}; {suggestion(label, labels)}"
            )
    return labels


def _of_model(parameters: ObjectDetectorParameters) -> ObjectDetectorParameters:
    """Return the parameters with which a model is loaded; the defaults for others."""
    return ObjectDetectorParameters(
        model=parameters.model, labels=parameters.labels, label_file=parameters.label_file,
        input_size=parameters.input_size,
    )  # fmt: skip


@lru_cache(maxsize=16)
def _tried(
    parameters: ObjectDetectorParameters, versions: tuple[object, ...]
) -> tuple[tuple[str, ...], str]:
    """Return the labels, or why the model cannot be used."""
    answer, problem = answer_of(__name__, parameters.model, json.dumps(asdict(parameters)))
    return tuple(answer or ()), problem


def answer_of(module: str, model: str, argument: str) -> tuple[Any, str]:
    """Run a module in a process of its own; return its answer, or what is wrong with a model.

    Args:
        module: prints JSON, its answer and a problem: a sentence, or empty.
        model: the file that it loads.
        argument: of its command line.
    """
    try:
        child = run_module(module, argument, longest=LONGEST)
    except subprocess.TimeoutExpired:
        return None, f"{model} does not load and run once within {LONGEST:g} s"
    try:
        answer, problem = json.loads(child.stdout.decode("utf-8").splitlines()[-1])
    except (ValueError, IndexError):
        return None, (
            f"{model} crashes OpenCV (exit code {child.returncode}): the file is "
            "damaged, or uses what OpenCV does not support; export the model again"
        )
    return answer, problem


def version_of(file: Path) -> tuple[int, int] | None:
    """Return what changes when a file is written; None if it cannot be read."""
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def _main() -> None:
    from stack.perception.objects.model import ObjectModel

    parameters = ObjectDetectorParameters(**json.loads(sys.argv[1]))
    try:
        answer: tuple[tuple[str, ...], str] = (ObjectModel(parameters).labels, "")
    except InputError as error:
        answer = ((), str(error))
    print(json.dumps(answer))


if __name__ == "__main__":
    _main()
