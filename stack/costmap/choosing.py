"""Which layers a costmap has, as missions say it."""

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
    """A layer by name, and what its entry says of its parameters.

    Attributes:
        use: the component's name.
        name: what this layer is called; the component's name unless there are several.
        component: its class.
        values: parameters given, raw; those missing are the costmap's own, or defaults.
        only: the costmap that has it: both, global or local.
    """

    use: str
    name: str
    component: type
    values: Mapping[str, Any] = field(default_factory=dict)
    only: str = "both"

    def parameters(self, costmap: CostmapParameters) -> Any:
        """The layer's parameters in a costmap with these settings.

        Raises:
            ParameterError: an unknown parameter or a value that will not do.
        """
        kind: Any = self.component
        own = declarations(kind.Parameters)
        shared = {
            item.name: getattr(costmap, item.name) for item in fields(costmap) if item.name in own
        }
        return build(kind.Parameters, {**shared, **self.values})

    def made(self, costmap: CostmapParameters, footprint: Footprint) -> CostmapLayer:
        """The layer itself."""
        layer: CostmapLayer = self.component(self.parameters(costmap), footprint)
        return layer

    def located(self, folder: Path) -> LayerChoice:
        """The same with its mask looked for in a folder.

        Raises:
            InputError: there is no such file.
        """
        if not self.values.get("mask"):
            return self
        file = folder / str(self.values["mask"])
        if not file.is_file():
            raise InputError(f"layer {self.name!r}: there is no mask {self.values['mask']}")
        return replace(self, values={**self.values, "mask": str(file)})


def usual_layers() -> tuple[LayerChoice, ...]:
    """The layers of a costmap whose mission names none."""
    return read_layers(USUAL, CostmapParameters())


def read_layers(raw: Any, costmap: CostmapParameters) -> tuple[LayerChoice, ...]:
    """The layers in a mission's list: names, or {use: name, only: local, parameter: value}.

    Raises:
        ParameterError: no such layer, or anything else that will not do; named `layers`.
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
                "layers", f"layer {number}: {choice.name!r} is there twice",
                "give the second one another `name`",
            )  # fmt: skip
        choices.append(choice)
    return tuple(choices)


def _read(item: Any) -> LayerChoice:
    if isinstance(item, str):
        item = {"use": item}
    if not isinstance(item, Mapping) or not isinstance(item.get("use"), str):
        raise ParameterError("", f"a layer is a name or {{use: name, parameter: value}}: {item!r}")
    only = item.get("only", "both")
    if only not in COSTMAPS:
        raise ParameterError(
            "only", f"{only!r} is not one of {', '.join(COSTMAPS)}", suggestion(str(only), COSTMAPS)
        )
    values = {key: value for key, value in item.items() if key not in _WORDS}
    use, name = item["use"], str(item.get("name", item["use"]))
    return LayerChoice(use, name, component("costmap_layer", use), values, only)
