"""Parameters of the object detector, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stack.errors import ParameterError
from stack.parameters import parameter


@dataclass(frozen=True)
class ObjectDetectorParameters:
    """Detection of objects in camera pictures by a trained model, and of people among tracks."""

    model: str = parameter(
        "", public=True,
        help="an ONNX file with a YOLO head, relative to the mission; empty: no model",
    )  # fmt: skip
    labels: tuple[str, ...] = parameter(
        (), public=True,
        help="names of the model's classes in their order; default: those that the file states",
    )  # fmt: skip
    label_file: str = parameter(
        "", public=True,
        help="a text file with a name on each line, instead of `labels`; relative to the mission",
    )  # fmt: skip
    only: tuple[str, ...] = parameter(
        (), public=True, help="labels that are detected; default: all"
    )
    threshold: float = parameter(
        0.5, above=0.0, at_most=1.0, public=True,
        help="score from which on an object counts as detected",
    )  # fmt: skip
    overlap: float = parameter(
        0.45, above=0.0, at_most=1.0,
        help="intersection over union above which two boxes of a label are one object",
    )  # fmt: skip
    rate: float = parameter(
        2.0, "Hz", above=0.0, at_most=30.0, public=True, help="pictures that are searched"
    )
    latency: float = parameter(
        0.3, "s", at_least=0.0, at_most=2.0,
        help="time from a picture's arrival to the use of its detections",
    )  # fmt: skip
    input_size: int = parameter(
        640, at_least=32, at_most=2048,
        help="side of the model's input in pixels, where the file leaves it open",
    )  # fmt: skip
    always: bool = parameter(
        False, help="search always; else only while a behaviour or a costmap layer needs it"
    )
    farthest: float = parameter(10.0, "m", above=0.0, help="objects farther away are ignored")
    memory: float = parameter(
        2.0, "s", above=0.0, help="age up to which a picture's detections are given to behaviours"
    )
    person_height: float = parameter(
        1.2, "m", above=0.0, at_most=2.5, help="height from which on a moving object is a person"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", _texts("labels", self.labels))
        object.__setattr__(self, "only", _texts("only", self.only))
        if self.labels and self.label_file:
            raise ParameterError("label_file", "both `labels` and `label_file` are set", "use one")

    def located(self, folder: Path) -> ObjectDetectorParameters:
        """Return a copy whose files are resolved relative to a folder."""
        if not self.model:
            return self
        model, labels = (
            str(folder / Path(name).expanduser()) if name else ""
            for name in (self.model, self.label_file)
        )
        return replace(self, model=model, label_file=labels)


def _texts(name: str, raw: Any) -> tuple[str, ...]:
    if not isinstance(raw, list | tuple) or not all(isinstance(item, str) for item in raw):
        raise ParameterError(name, f"expected a list of labels, got {raw!r}")
    return tuple(raw)
