"""The network of a policy: an ONNX file from observations to an action."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from stack.control.policy.observations import Observations, Values, Vector
from stack.errors import InputError
from stack.networks.onnx_file import OnnxHeader, Tensor, read_header
from stack.networks.trial import answer, tried

Shapes = Mapping[str, tuple[int, ...]]


class PolicyNetwork:
    """A network that OpenCV runs, with an input for each observation, or one for all of them.

    A picture enters as (1, 3, rows, columns) from 0 to 1, everything else as (1, n), or in the
    shape of the file. An only input of another name is the flat vector of all observations.

    Args:
        file: ONNX.
        shapes: of the observations, by name, in their order.
        actions: numbers of an action.

    Raises:
        InputError: the file is no ONNX model, has other inputs or outputs, or does not run.
    """

    def __init__(self, file: Path, shapes: Shapes, actions: int) -> None:
        from stack.networks.network import Network  # imports OpenCV

        header = read_header(file)
        self._is_flat = len(header.inputs) == 1 and header.inputs[0].name not in shapes
        if self._is_flat:
            shapes = {header.inputs[0].name: _flat_shape(file, header, shapes)}
        self._shapes = {tensor.name: _shape_of(file, tensor, shapes) for tensor in header.inputs}
        unused = [name for name in shapes if name not in self._shapes]
        if unused:
            inputs = ", ".join(map(str, header.inputs))
            raise InputError(
                f"{file} has no input {unused[0]!r}; its inputs are {inputs}: take "
                f"{unused[0]!r} out of `observations`, or export the model with it"
            )
        self._network = Network(file, header)
        self._try(actions)

    def decide(self, observed: Mapping[str, Values]) -> Vector:
        """Return the action for observations by name."""
        inputs = {name: _prepared(values) for name, values in observed.items()}
        if self._is_flat:
            (name,) = self._shapes
            inputs = {name: np.concatenate([values.ravel() for values in inputs.values()])}
        shaped = {name: inputs[name].reshape(shape) for name, shape in self._shapes.items()}
        return self._network.run(shaped)[0].ravel()

    def _try(self, actions: int) -> None:
        zeros = {name: np.zeros(shape, np.float32) for name, shape in self._shapes.items()}
        remedy = "export it with these sizes, or with all of them open but the last"
        what = ", ".join(f"{name} ({_sizes(shape)})" for name, shape in self._shapes.items())
        outputs = self._network.tried(zeros, f"an input {what}", remedy)
        file = self._network.file
        if len(outputs) != 1 or outputs[0].size != actions:
            got = ", ".join(_sizes(output.shape) for output in outputs)
            raise InputError(
                f"{file} has an output of {got}; a policy for this robot has one of 1 x {actions}, "
                "the action; export its mean action alone"
            )
        if not np.isfinite(outputs[0]).all():
            raise InputError(
                f"{file} decides a velocity that is not finite where all observations are 0; "
                "check the export, e.g. a division by the length of a vector"
            )


def _prepared(values: Values) -> Vector:
    """Return an observation as a network gets it."""
    if values.dtype == np.uint8:
        scaled = values.astype(np.float32) / np.float32(255.0)
        return np.ascontiguousarray(scaled.transpose(2, 0, 1))
    return values.astype(np.float32)


def _flat_shape(file: Path, header: OnnxHeader, shapes: Shapes) -> tuple[int, ...]:
    """Return the shape (n,) of all observations together."""
    pictures = [name for name, shape in shapes.items() if len(shape) == 3]
    if pictures:
        raise InputError(
            f"{file} has one input, {header.inputs[0]}, and {pictures[0]!r} is no part of a flat "
            "one; export the model with an input for each observation, called like it"
        )
    return (sum(prod(shape) for shape in shapes.values()),)


def _shape_of(file: Path, tensor: Tensor, shapes: Shapes) -> tuple[int, ...]:
    """Return the sizes of an input: those of the file, with those of the observation where open."""
    shape = shapes.get(tensor.name)
    if shape is None:
        raise InputError(
            f"{file} has an input {tensor}, which is no observation of this controller; expected "
            f"{', '.join(shapes)}: add it to `observations`, or export the model without it"
        )
    wanted = (1, *shape) if len(shape) == 3 else (1, prod(shape))
    given = tensor.shape
    if not given or given == (None,):
        return wanted
    if len(given) == len(wanted) and all(
        size in (None, here) for size, here in zip(given, wanted, strict=True)
    ):
        return wanted
    own = [size for size in given[1:] if size is not None]
    if given[0] in (None, 1) and len(own) == len(given) - 1 and prod(own) == prod(shape):
        return (1, *own)
    raise InputError(
        f"{file} has an input {tensor}, but here it has {_sizes(wanted)}; make `observations` and "
        "their sizes those of the training"
    )


def _sizes(shape: tuple[int, ...]) -> str:
    return " x ".join(map(str, shape)) or "one number"


def network_shapes(observations: Observations) -> dict[str, tuple[int, ...]]:
    """Return the shapes in which a network gets observations, without the batch."""
    shapes = {}
    for field in observations.fields:
        shape = field.low.shape
        shapes[field.name] = (3, *shape[:2]) if field.low.dtype == np.uint8 else shape
    return shapes


def check_network(file: str, observations: Observations, actions: int) -> None:
    """Try the network in another process.

    Raises:
        InputError: as `PolicyNetwork`, or the model crashes.
    """
    settings = {"file": file, "shapes": network_shapes(observations), "actions": actions}
    tried(__name__, settings, [file])


def _trial(raw: dict[str, Any]) -> bool:
    shapes = {name: tuple(shape) for name, shape in raw["shapes"].items()}
    PolicyNetwork(Path(raw["file"]), shapes, raw["actions"])
    return True


if __name__ == "__main__":
    answer(_trial)
