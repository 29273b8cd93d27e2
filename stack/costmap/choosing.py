"""The list of costmap layers in a mission file: read, checked and built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from stack.components import component
from stack.costmap.layer import CostmapLayer
from stack.costmap.parameters import CostmapParameters
from stack.errors import InputError, ParameterError
from stack.parameters import build, declarations, suggestion
from stack.types import Footprint

USUAL = ("static", "obstacle", "inflation")
COSTMAPS = ("both", "global", "local")
_WORDS = ("use", "name", "only")


@dataclass(frozen=True)
class LayerChoice:
    """One entry of a mission's list of layers.

    Attributes:
        use: name of the component.
        name: name of this layer; default: the component's name.
        component: class of the layer.
        values: raw parameters of the entry; missing ones come from the costmap, then the defaults.
        only: the costmap that uses the layer: both, global or local.
    """

    use: str
    name: str
    component: type
    values: Mapping[str, Any] = field(default_factory=dict)
    only: str = "both"

    def parameters(self, costmap: CostmapParameters) -> Any:
        """Return the layer's parameters for a costmap with these settings.

        Raises:
            ParameterError: an unknown parameter or an invalid value.
        """
        kind: Any = self.component
        own = declarations(kind.Parameters)
        shared = {
            item.name: getattr(costmap, item.name) for item in fields(costmap) if item.name in own
        }
        return build(kind.Parameters, {**shared, **self.values})

    def made(self, costmap: CostmapParameters, footprint: Footprint) -> CostmapLayer:
        """Create the layer."""
        layer: CostmapLayer = self.component(self.parameters(costmap), footprint)
        return layer

    def located(self, folder: Path) -> LayerChoice:
        """Return a copy whose mask file is resolved relative to a folder.

        Raises:
            InputError: the mask file does not exist.
        """
        if not self.values.get("mask"):
            return self
        file = folder / str(self.values["mask"])
        if not file.is_file():
            raise InputError(
                f"layer {self.name!r}: mask file {self.values['mask']} does not exist; "
                "paths are relative to the mission file"
            )
        return replace(self, values={**self.values, "mask": str(file)})


def usual_layers() -> tuple[LayerChoice, ...]:
    """Return the default layers, used when a mission does not list any."""
    return read_layers(USUAL, CostmapParameters())


def read_layers(raw: Any, costmap: CostmapParameters) -> tuple[LayerChoice, ...]:
    """Read a mission's list of layers: names, or {use: name, only: local, parameter: value}.

    Raises:
        ParameterError: an unknown layer or another invalid entry; its parameter is `layers`.
    """
    if not isinstance(raw, Sequence) or isinstance(raw, str):
        raise ParameterError("layers", f"expected a list of layers, got {raw!r}")
    choices: list[LayerChoice] = []
    for number, item in enumerate(raw, start=1):
        try:
            choice = _read(item)
            choice.parameters(costmap)
        except ParameterError as error:
            raise ParameterError("layers", f"layer {number}: {error}", error.hint) from None
        except InputError as error:
            raise ParameterError("layers", f"layer {number}: {error}") from None
        if any(other.name == choice.name for other in choices):
            raise ParameterError(
                "layers", f"layer {number}: the name {choice.name!r} is used twice",
                "give the second layer a different `name`",
            )  # fmt: skip
        choices.append(choice)
    return tuple(choices)


def _read(item: Any) -> LayerChoice:
    if isinstance(item, str):
        item = {"use": item}
    if not isinstance(item, Mapping) or not isinstance(item.get("use"), str):
        raise ParameterError(
            "", f"expected a layer name or {{use: name, parameter: value}}, got {item!r}"
        )
    only = item.get("only", "both")
    if only not in COSTMAPS:
        raise ParameterError(
            "only", f"{only!r} is not one of {', '.join(COSTMAPS)}", suggestion(str(only), COSTMAPS)
        )
    values = {key: value for key, value in item.items() if key not in _WORDS}
    use, name = item["use"], str(item.get("name", item["use"]))
    return LayerChoice(use, name, component("costmap_layer", use), values, only)
