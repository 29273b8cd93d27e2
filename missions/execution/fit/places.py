"""Place recognition of a mission: its model, and the keyframes of the map."""

from __future__ import annotations

from dataclasses import replace

from missions.execution.resources import map_folder
from missions.language.model import Mission
from stack.components import Choice
from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.perception.places.descriptor import checked_digest
from stack.perception.places.keyframe_files import check_keyframes
from stack.perception.places.parameters import PlaceParameters

KIND = "place_recognition"


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
        sentence = f"{KIND}: {error}".replace(parameters.descriptor, given.descriptor)
        raise InputError([Finding(_mark(mission), "E111", sentence)]) from None
    folder = map_folder(mission.map, mission.source.parent)
    if folder is not None:
        check_keyframes(folder, digest)
    return replace(choice, parameters=parameters)


def _mark(mission: Mission) -> Mark:
    """Return the position of the model's file; the start of the mission if it is not there."""
    named = mission.components.get(KIND)
    if named is None:
        return Mark(str(mission.source))
    return named.marks.get("descriptor", named.mark)
