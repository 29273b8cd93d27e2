"""`treepilot explain CODE`: what a finding means, an example that provokes it, and the fix."""

from __future__ import annotations

from missions.language.codes import CODES, Code
from stack.errors import InputError
from stack.parameters import suggestion

FILE_CODES: dict[str, Code] = {
    "E001": Code("file", "there is no such file, or it cannot be read",
                 "treepilot check nowhere.yaml", "give the path of a file"),
    "E002": Code("file size", "the file is larger than 1 MB", "", "use smaller files"),
    "E003": Code("not text", "the file has bytes or characters that are not text", "",
                 "save it as UTF-8"),
    "E004": Code("not YAML", "the text breaks off or is indented in a way that YAML does not know",
                 "run: [{say: a}", "close what is open; indent with spaces"),
    "E005": Code("empty", "there is nothing in the file", "# only a comment", "write something"),
    "E006": Code("several documents", "a file holds one document", "a: 1\n---\nb: 2",
                 "remove `---`"),
    "E007": Code("not a mapping", "a file is a mapping of keys", "- a list",
                 "write `key: value` lines"),
    "E008": Code("too much", "aliases contain themselves or make the file too large",
                 "a: &x [*x]", "write it out"),
    "E009": Code("tag", "YAML tags are not used", "run: !!python/object {}", "leave it out"),
    "E010": Code("key", "a key is a word", "[1, 2]: 3", "write a word"),
    "E011": Code("key twice", "the same key stands twice in one mapping", "run: {}\nrun: {}",
                 "remove one"),
    "E012": Code("number", "a number is too large or not finite", "x: .inf",
                 "write a finite number"),
    "E201": Code("world: shape", "a key is unknown, missing, or has a wrong type, unit or range",
                 "walls: 3", "use the key that is suggested"),
    "E202": Code("world: twice", "a name or marker id is given twice",
                 "doors: {a: …, a: …}", "rename one"),
    "E203": Code("world: unknown name", "a door, place or marker id that does not exist is named",
                 "at: {3 s: {close: dor_a}}", "use the name that is suggested"),
    "E204": Code("world: placement", "something lies inside a wall or outside the bounds",
                 "start: [100, 100]", "move it"),
    "E205": Code("world: too many", "there are more things than a simulation can hold", "",
                 "leave some out"),
    "E206": Code("world: nothing solid", "the world has no walls, boxes or cylinders",
                 "walls: []", "give it walls"),
    "E207": Code("world: not XML", "a .world or .sdf file is not XML",
                 "<world><model></world>", "close what is open"),
    "E208": Code("world: left out", "something of a Gazebo world is left out or replaced",
                 "<plugin filename='fog.so'/>", "nothing, if it does not matter (a warning)"),
    "E301": Code("robot: shape", "a key is unknown, missing, or has a wrong type, unit or range",
                 "limits: {linear_speed: fast}", "use the key that is suggested"),
    "E302": Code("robot: URDF", "the URDF cannot be read or lacks a link or joint that is named",
                 "urdf: nowhere.urdf", "name a URDF that has it"),
    "E303": Code("robot: footprint", "the footprint does not fit the robot",
                 "footprint: {radius: 0}", "give the outline of the robot"),
    "E401": Code("map: shape", "a key of map.yaml is missing or wrong", "resolution: coarse",
                 "write it as ROS map_server does"),
    "E402": Code("map: picture", "the map's picture cannot be read", "image: nowhere.pgm",
                 "name a PGM or PNG"),
    "E430": Code("route graph: file", "it is not a GeoJSON FeatureCollection, or has no edge",
                 "[1, 2]", "write a FeatureCollection with Point and LineString features"),
    "E431": Code("route graph: feature", "a geometry or property of a feature is wrong",
                 '{"type": "Feature", "geometry": {"type": "Polygon"}}',
                 "nodes are Points with `id`, edges LineStrings with `id`, `from` and `to`"),
    "E432": Code("route graph: ids", "an id is given twice, or an edge names a node there is not",
                 '"properties": {"id": "a", "from": "nowhere", "to": "b"}',
                 "use the id that is suggested"),
    "W430": Code("route graph: not used", "a property means nothing here, or a node has no edge",
                 '"properties": {"id": 1, "metadata": {}}', "leave it out, if it is not needed"),
    "W431": Code("route graph: in the way", "an edge leads through something on the map",
                 "", "draw it elsewhere"),
    "E412": Code("start: in the way", "the robot would start outside the world or inside something",
                 "start: [100, 100]", "start at one of the world's places"),
}  # fmt: skip
"""Codes of files, worlds, robots and maps; missions' own are in missions.language.codes."""


def every_code() -> dict[str, Code]:
    """All codes that a finding can carry, in order."""
    return dict(sorted({**FILE_CODES, **CODES}.items()))


def explanation(code: str) -> str:
    """Cause, example and fix of a code, as text.

    Raises:
        InputError: there is no such code.
    """
    known, name = every_code(), code.strip().upper()
    if name not in known:
        near = [one for one in known if one[:2] == name[:2]] or list(known)
        raise InputError(f"there is no code {code!r}; {suggestion(name, near)}")
    found = known[name]
    kind = "warning" if name.startswith("W") else "error"
    lines = [f"{name} ({kind}): {found.title}", "", f"cause    {found.cause}"]
    for number, line in enumerate(found.example.splitlines()):
        lines.append(f"{'example' if not number else '':<9}{line}")
    return "\n".join([*lines, f"fix      {found.fix}"])
