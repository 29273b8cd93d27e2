"""The list of costmap layers in a mission file: read, checked and built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from stack.components import component
from stack.costmap.layer import Layer
from stack.costmap.parameters import CostmapParameters
from stack.costmap.zones import located_mask
from stack.drivetrain.needs import needs_problem
from stack.errors import InputError, ParameterError
from stack.parameters import build, declarations, suggestion, values_of
from stack.types import Footprint

COSTMAPS = ("both", "global", "local")
SENSORS = "sensors"
"""Entry of a list of layers that stands for the usual layers of the robot's sensors."""

LIDAR_ONLY = ("obstacle",)
"""The usual layers of a robot whose only sensor is a lidar."""

_LAYER_KEYS = ("use", "name", "only", "inflated")
_FORMER_LAYERS = {
    "inflation": (
        "inflation is not a layer any more: every costmap inflates",
        "remove it from the list; its parameters are those of the costmap, e.g. `costmap: "
        "{inflation_radius: 0.4 m}`, or `local_inflation_radius` for the local costmap; layers "
        "listed after it need `inflated: false`",
    ),
    "speed_zones": (
        "speed_zones moved to `navigation: {speed_limits: …}`",
        "write its zones, mask, full_speed and look_ahead there, without use, name and only",
    ),
}
"""Former layers: what became of them, and what to write instead."""


@dataclass(frozen=True)
class LayerChoice:
    """One entry of a mission's list of layers.

    Attributes:
        use: name of the component.
        name: name of this layer; default: the component's name.
        component: class of the layer.
        values: raw parameters of the entry; missing ones come from the costmap, then the defaults.
        only: the costmap that uses the layer: both, global or local.
        inflated: whether the layer's marks are inflated; None: as the layer's class says.
    """

    use: str
    name: str
    component: type[Layer]
    values: Mapping[str, Any] = field(default_factory=dict)
    only: str = "both"
    inflated: bool | None = None

    @property
    def is_inflated(self) -> bool:
        """Whether the layer's marks are inflated."""
        return self.component.inflated if self.inflated is None else self.inflated

    def parameters(self, costmap: CostmapParameters) -> Any:
        """Return the layer's parameters for a costmap with these settings.

        Raises:
            ParameterError: an unknown parameter or an invalid value.
        """
        own = declarations(self.component.Parameters)
        shared = {name: value for name, value in values_of(costmap).items() if name in own}
        return build(self.component.Parameters, {**shared, **self.values})

    def made(self, costmap: CostmapParameters, footprint: Footprint) -> Layer:
        """Create the layer.

        Raises:
            InputError: the class cannot be created with parameters and footprint.
        """
        parameters, name = self.parameters(costmap), self.component.__qualname__
        try:
            return self.component(parameters, footprint)
        except TypeError as error:
            raise InputError(
                f"layer {self.name!r}: {name}(parameters, footprint) failed: {error}; expected a "
                "constructor with these two positional arguments, as in treepilot.CostmapLayer"
            ) from error

    def located(self, folder: Path) -> LayerChoice:
        """Return a copy whose mask file is resolved relative to a folder.

        Raises:
            InputError: the mask file does not exist.
        """
        mask = self.values.get("mask")
        if not mask:
            return self
        file = located_mask(str(mask), folder, f"layer {self.name!r}")
        return replace(self, values={**self.values, "mask": file})


def usual_layers(
    lidars: Sequence[str] = ("lidar",), sonars: Sequence[str] = (), *, depth: bool = False
) -> tuple[LayerChoice, ...]:
    """Return the default layers, used when a mission does not list any.

    The map, one obstacle layer for each lidar, one for the depth cameras of a robot that has some,
    and the sonars of a robot without a lidar. Beside a lidar, the wide cones of sonars would close
    doors; list `range` where they are wanted. People who walk change no path: who is there now has
    gone when the robot comes. List `social` to plan round where they walk.
    """
    layers = ["static", *sensing_layers(lidars, sonars, depth=depth)]
    return for_lidars(read_layers(layers, CostmapParameters()), lidars)


def sensing_layers(lidars: Sequence[str], sonars: Sequence[str], *, depth: bool) -> list[str]:
    """Return the usual layers without the map; `usual_layers` says which."""
    ranges = ["obstacle"] if lidars else ["range"] if sonars else []
    return [*ranges, "depth"] if depth else ranges


def with_sensors(raw: Any, sensing: Sequence[str]) -> Any:
    """Return a list of layers with those of the robot's sensors in place of `sensors`.

    Parameters of such an entry are those of its obstacle layer, and its name is the beginning of
    theirs. Anything else is left as it is.
    """
    if not isinstance(raw, list):
        return raw
    found: list[Any] = []
    for item in raw:
        entry = {"use": item} if isinstance(item, str) else item
        if not isinstance(entry, Mapping) or entry.get("use") != SENSORS:
            found.append(item)
            continue
        own = {key: entry[key] for key in ("only", "inflated") if key in entry}
        values = {key: value for key, value in entry.items() if key not in _LAYER_KEYS}
        prefix = f"{entry['name']}_" if "name" in entry else ""
        for use in sensing:
            more = values if use == "obstacle" else {}
            found.append({"use": use, "name": prefix + use, **own, **more})
    return found


def for_lidars(choices: Sequence[LayerChoice], lidars: Sequence[str]) -> tuple[LayerChoice, ...]:
    """Return the layers with those that name no `source` repeated for every lidar of a robot.

    A lidar that another layer of this kind names as its source is left to that layer.
    """
    named = {(choice.use, choice.values.get("source")) for choice in choices}
    found: list[LayerChoice] = []
    for choice in choices:
        if "source" not in declarations(choice.component.Parameters) or "source" in choice.values:
            found.append(choice)
            continue
        free = [name for name in lidars if (choice.use, name) not in named]
        found += [_reading(choice, name) for name in free] or [choice]
    return tuple(found)


def _reading(choice: LayerChoice, lidar: str) -> LayerChoice:
    """Return the layer for one lidar."""
    if lidar == "lidar":
        return choice
    values = {**choice.values, "source": lidar}
    return replace(choice, name=f"{choice.name}_{lidar}", values=values)


def read_layers(raw: Any, costmap: CostmapParameters) -> tuple[LayerChoice, ...]:
    """Read a mission's list of layers: names, or {use: name, only: local, parameter: value}.

    An entry `sensors` that `with_sensors` has not replaced is that of a robot with one lidar.

    Raises:
        ParameterError: an unknown layer or another invalid entry; its parameter is `layers`.
    """
    if not isinstance(raw, Sequence) or isinstance(raw, str):
        raise ParameterError("layers", f"expected a list of layers, got {raw!r}")
    choices: list[LayerChoice] = []
    for number, item in enumerate(with_sensors(raw, LIDAR_ONLY), start=1):
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
    inflated = item.get("inflated")
    if "inflated" in item and not isinstance(inflated, bool):
        raise ParameterError("inflated", f"expected true or false, got {inflated!r}")
    values = {key: value for key, value in item.items() if key not in _LAYER_KEYS}
    use, name = item["use"], str(item.get("name", item["use"]))
    return LayerChoice(use, name, _layer_class(use), values, only, inflated)


def _layer_class(use: str) -> type[Layer]:
    """Return the class of a layer by name or `module:Class`.

    Raises:
        InputError: there is no such component, or it is not a layer.
        ParameterError: the name is that of a former layer.
    """
    if use in _FORMER_LAYERS:
        sentence, hint = _FORMER_LAYERS[use]
        raise ParameterError("use", sentence, hint)
    found = component("costmap_layer", use)
    if not issubclass(found, Layer):
        raise InputError(
            f"{found.__qualname__} in {found.__module__} is not a costmap layer; "
            "inherit treepilot.CostmapLayer"
        )
    problem = needs_problem(found.needs)
    if problem:
        raise InputError(f"{found.__qualname__} in {found.__module__} cannot be used: {problem}")
    missing = sorted(found.__abstractmethods__)
    if missing:
        raise InputError(
            f"{found.__qualname__} in {found.__module__} is not a complete costmap layer; "
            f"it does not implement {', '.join(missing)}"
        )
    return found
