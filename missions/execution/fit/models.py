"""Models of a mission: object detector with its labels, place recognition, policy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from missions.execution.fit.components import mark_of_component
from missions.execution.fit.steps import every_leaf
from missions.execution.resources import map_folder
from missions.language.analysis.claims import mark_of
from missions.language.model import Mission
from missions.language.values import Constant
from stack.components import Choice
from stack.control.policy.controller import OnnxPolicy
from stack.control.policy.network import check_network
from stack.control.policy.observations import Actions, Observations
from stack.control.policy.parameters import OnnxPolicyParameters
from stack.documents import Finding
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion
from stack.perception.objects.parameters import ObjectDetectorParameters
from stack.perception.objects.trial import checked_labels
from stack.perception.places.descriptor import checked_digest
from stack.perception.places.keyframe_files import check_keyframes
from stack.perception.places.parameters import PlaceParameters

KIND, PLACES, POLICY = "object_detector", "place_recognition", "controller"


def located_detector(
    choices: Mapping[str, Choice], mission: Mission, robot: RobotDescription
) -> tuple[Choice, tuple[Finding, ...]]:
    """Return the detector with the paths of its files resolved, and warnings.

    Raises:
        InputError: its model cannot be used, or a node searches for a label that it does not have.
    """
    choice = choices[KIND]
    given: ObjectDetectorParameters = choice.parameters
    parameters = given.located(mission.source.parent)
    labels: tuple[str, ...] = ()
    if given.model:
        try:
            labels = checked_labels(parameters)
        except InputError as error:
            # The message names the file as the mission does: reports have no absolute paths.
            sentence = f"{KIND}: {error}".replace(parameters.model, given.model)
            if given.label_file:
                sentence = sentence.replace(parameters.label_file, given.label_file)
            mark = mark_of_component(mission, KIND, "model")
            raise InputError([Finding(mark, "E111", sentence)]) from None
    found = list(_searches(mission, given, labels))
    if found:
        raise InputError(found)
    warnings = tuple(_warnings(choices, mission, robot, labels))
    return replace(choice, parameters=parameters), warnings


def _searches(
    mission: Mission, detector: ObjectDetectorParameters, labels: tuple[str, ...]
) -> Iterator[Finding]:
    """Yield errors of the nodes that search for an object."""
    for step in every_leaf(mission):
        label = step.behaviour.label_port
        if not label:
            continue
        value = step.ports.get(label)
        mark = mark_of(value, step.mark)
        if (value is None) == ("colour" not in step.ports):
            sentence = f"{step.kind} needs either a `colour` or a `{label}`"
            yield Finding(mark, "E111", sentence, f"write `colour: red`, or `{label}: chair`")
        elif value is not None and not detector.model:
            yield Finding(
                mark, "E111", f"{step.kind} searches for a label, and no object detector is set",
                f"add `navigation: {{{KIND}: {{model: FILE.onnx}}}}`, or search for a `colour`",
            )  # fmt: skip
        elif isinstance(value, Constant) and value.value not in labels:
            yield Finding(
                mark, "E111", f"{label}: {detector.model} has no label {value.value!r}",
                suggestion(str(value.value), labels),
            )  # fmt: skip
        elif isinstance(value, Constant) and detector.only and value.value not in detector.only:
            sentence = f"{label}: {KIND}.only leaves out {value.value!r}"
            yield Finding(mark, "E111", sentence, "add it to `only`")


def _warnings(
    choices: Mapping[str, Choice], mission: Mission, robot: RobotDescription,
    labels: tuple[str, ...],
) -> Iterator[Finding]:  # fmt: skip
    """Yield warnings about a model or a layer without effect."""
    if labels and robot.camera is None:
        sentence = f"{robot.name} has no camera: the object detector sees nothing"
        yield Finding(mark_of_component(mission, KIND, "model"), "W142", sentence)
    depth = bool(robot.depth_cameras) and choices["depth"].parameters.obstacles
    uses = any(layer.component.needs_detections for layer in choices["costmap"].parts)
    if uses and not labels and not depth:
        sentence = "the layer `semantic` has no effect: nothing tells it what things are"
        hint = f"set `{KIND}: {{model: FILE.onnx}}`, or `depth: {{obstacles: true}}` for people"
        yield Finding(mark_of_component(mission, "costmap", "layers"), "W142", sentence, hint)


def located_places(choice: Choice, mission: Mission) -> Choice:
    """Return place recognition with the path of its model resolved.

    Raises:
        InputError: the model cannot be used, or the keyframes of the map are damaged or of another
            model.
    """
    given: PlaceParameters = choice.parameters
    parameters = given.located(mission.source.parent)
    try:
        digest = checked_digest(parameters)
    except InputError as error:
        # The message names the file as the mission does: reports have no absolute paths.
        sentence = f"{PLACES}: {error}".replace(parameters.descriptor, given.descriptor)
        mark = mark_of_component(mission, PLACES, "descriptor")
        raise InputError([Finding(mark, "E111", sentence)]) from None
    folder = map_folder(mission.map, mission.source.parent)
    if folder is not None:
        check_keyframes(folder, digest)
    return replace(choice, parameters=parameters)


def located_policy(choice: Choice, mission: Mission, robot: RobotDescription) -> Choice:
    """Return the controller with the path of its policy resolved; others as they are.

    Raises:
        InputError: there is no such policy, or its inputs and outputs are not those of the robot.
    """
    if not issubclass(choice.component, OnnxPolicy):
        return choice
    given: OnnxPolicyParameters = choice.parameters
    parameters = given.located(mission.source.parent)
    mark = mark_of_component(mission, POLICY, "file")
    if not given.file:
        hint = "write `controller: {use: onnx_policy, file: policy.onnx}`"
        raise InputError([Finding(mark, "E111", f"{choice.name}: `file` is missing", hint)])
    try:
        observations = Observations(parameters, robot)
    except InputError:
        return choice  # the check of the robot says so
    try:
        check_network(parameters.file, observations, len(Actions(parameters, robot).low))
    except InputError as error:
        # The message names the file as the mission does: reports have no absolute paths.
        sentence = f"{choice.name}: {error}".replace(parameters.file, given.file)
        raise InputError([Finding(mark, "E111", sentence)]) from None
    return replace(choice, parameters=parameters)
