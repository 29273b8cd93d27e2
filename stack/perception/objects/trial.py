"""Trial of a detector's model in a process of its own."""

from __future__ import annotations

from stack.errors import InputError
from stack.networks.trial import tried
from stack.parameters import suggestion
from stack.perception.objects.parameters import ObjectDetectorParameters


def checked_labels(parameters: ObjectDetectorParameters) -> tuple[str, ...]:
    """Try the model of a detector; return its labels.

    Raises:
        InputError: as `ObjectModel`; the model crashes; or `only` has a label that the model does
            not have.
    """
    p = parameters
    settings = {
        "model": p.model, "labels": p.labels, "label_file": p.label_file,
        "input_size": p.input_size,
    }  # fmt: skip
    labels = tuple(tried("stack.perception.objects.model", settings, (p.model, p.label_file)))
    for label in p.only:
        if label not in labels:
            raise InputError(f"only: {p.model} has no label {label!r}; {suggestion(label, labels)}")
    return labels
