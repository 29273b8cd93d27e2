"""`treepilot explain CODE`: the cause of a finding, an example and the fix."""

from __future__ import annotations

from behaviours.catalogue import find_behaviours
from missions.language.codes import CODES, Code
from stack.errors import Finding, InputError, Mark
from stack.optional_packages import MISSING_DEVICE, MISSING_PACKAGE
from stack.parameters import suggestion
from stack.types import FailureCode

FILE_CODES: dict[str, Code] = {
    "E001": Code("file", "the file does not exist or cannot be read",
                 "treepilot check nowhere.yaml", "give the path of a file"),
    "E002": Code("file size", "the file is larger than files of its kind may be", "",
                 "use smaller files; docs/worlds.md lists the limits"),
    "E003": Code("not text", "the file is not UTF-8 text", "",
                 "save it as UTF-8"),
    "E004": Code("not YAML", "the file is not valid YAML: incomplete, or wrong indentation",
                 "run: [{say: a}", "close all brackets and quotes; indent with spaces"),
    "E005": Code("empty", "the file is empty", "# only a comment", "add the content"),
    "E006": Code("several documents", "the file contains more than one YAML document",
                 "a: 1\n---\nb: 2", "remove `---`"),
    "E007": Code("another kind of file",
                 "the file has none of the keys of its kind, or is of another program",
                 "- a list", "give the path of a file of the expected kind"),
    "E008": Code("too large", "aliases contain themselves, or make the file too large or "
                 "nested too deeply",
                 "a: &x [*x]", "write the values without aliases"),
    "E009": Code("tag", "YAML tags are not supported", "run: !!python/object {}", "remove the tag"),
    "E010": Code("key", "a key is not a word", "[1, 2]: 3", "use a word as the key"),
    "E011": Code("duplicate key", "a mapping contains the same key twice", "run: {}\nrun: {}",
                 "remove one of the keys"),
    "E012": Code("number", "a number is too large or not finite", "x: .inf",
                 "write a finite number"),
    "E013": Code("control character", "a text contains a character that controls a terminal, or "
                 "the direction of writing", 'name: "\\e[2J"', "remove it"),
    "E201": Code("world: key or value", "a key is unknown or missing, or its value has a wrong "
                 "type, unit or range", "walls: 3", "use the suggested key or value"),
    "E202": Code("world: duplicate name", "two items have the same name or marker id",
                 "doors: {a: …, a: …}", "rename one of them"),
    "E203": Code("world: unknown name", "the door, place or marker id does not exist",
                 "at: {3 s: {close: dor_a}}", "use the suggested name"),
    "E204": Code("world: placement", "an item is inside a wall or outside the bounds",
                 "start: [100, 100]", "move the item"),
    "E205": Code("world: too many", "the world has more items than the simulation supports", "",
                 "remove some items"),
    "E206": Code("world: no obstacles", "the world has no walls, boxes or cylinders",
                 "walls: []", "add walls"),
    "E207": Code("world: not XML", "a .world or .sdf file is not valid XML",
                 "<world><model></world>", "close all elements"),
    "W208": Code("world: not supported", "an element of a Gazebo world is ignored or replaced",
                 "<plugin filename='fog.so'/>", "none needed if the element does not matter"),
    "E210": Code("fault", "a fault is one kind with its numbers, and `at` and `for`; a kind, a "
                 "number or a place is unknown or wrong", "faults: [{lidar_dropuot: {share: 0.4}}]",
                 "use the suggested name; `treepilot list faults` and `treepilot describe NAME`"),
    "E211": Code("fault: does not fit", "the robot or the world has nothing for a fault: no such "
                 "sensor, wheel or door, or no simulation", "faults: [depth_holes]  # no depth "
                 "camera", "remove it, or use another robot or world"),
    "E301": Code("robot: key or value", "a key is unknown or missing, or its value has a wrong "
                 "type, unit or range", "limits: {linear_speed: fast}",
                 "use the suggested key or value"),
    "E302": Code("robot: URDF", "the URDF cannot be read, its links are no tree, a mass or size "
                 "is not possible, or its wheels are not those of `wheels`",
                 "urdf: nowhere.urdf", "correct the URDF or the robot file as the finding says"),
    "W302": Code("robot: part of the URDF", "a mesh to draw is missing, or an inertia is not that "
                 "of a rigid body; the simulation leaves it out or corrects it",
                 '<mesh filename="package://elsewhere/body.stl"/>',
                 "name the folder of the package, or correct the inertia"),
    "W303": Code("robot: file and URDF differ", "shapes of the URDF are outside `footprint` or "
                 "above `height`, or a sensor is not where its link is",
                 "lidar: {position: [1 m, 0]}", "use the numbers of the URDF"),
    "E303": Code("robot: footprint", "the footprint does not fit the robot",
                 "footprint: {radius: 0}", "write the outline of the robot"),
    "E304": Code("robot: arm", "the URDF has no arm or gripper as described, a joint has no "
                 "limits, or a posture is beyond them", "arm: {tool: hnad}",
                 "use the suggested name or value, or correct the URDF"),
    "E401": Code("map: key or value", "a key of map.yaml is missing or has a wrong value",
                 "resolution: coarse", "use the format of the ROS map_server"),
    "W401": Code("map: unknown key", "map.yaml has a key that the map_server does not know",
                 "negated: 0", "correct the key, or remove it"),
    "E402": Code("map: image", "the image of the map cannot be read", "image: nowhere.pgm",
                 "name a PGM, PPM, PNG, BMP or JPEG file"),
    "E405": Code("map of markers: key or value", "a key is unknown or missing, or its value has a "
                 "wrong type, unit or range", "markers: [{id: 7}]",
                 "use the suggested key or value"),
    "E406": Code("map of markers: ids", "an id is used twice, or the dictionary does not have it",
                 "{id: 99, dictionary: DICT_4X4_50}", "use another id or dictionary"),
    "E430": Code("route graph: file", "the file is not a GeoJSON FeatureCollection or has no edge",
                 "[1, 2]", "write a FeatureCollection with Point and LineString features"),
    "E431": Code("route graph: feature", "a geometry or property of a feature is wrong",
                 '{"type": "Feature", "geometry": {"type": "Polygon"}}',
                 "nodes are Points with `id`, edges LineStrings with `id`, `from` and `to`"),
    "E432": Code("route graph: ids", "an id is used twice, or an edge names an unknown node",
                 '"properties": {"id": "a", "from": "nowhere", "to": "b"}',
                 "use the suggested id"),
    "W430": Code("route graph: unused", "a property is not supported, or a node has no edge",
                 '"properties": {"id": 1, "metadata": {}}', "remove it if it is not needed"),
    "W431": Code("route graph: collision", "an edge leads through an obstacle of the map or a zone",
                 "", "move the edge"),
    "E520": Code("sweep", "a key of the file of a sweep is unknown or wrong, or its mission "
                 "refuses a value of a factor", "vary: {controller.cruise_sped: [0.4, 0.8]}",
                 "use the suggested name, or a value that the mission accepts"),
    "E403": Code("map: pose graph", "graph.json, graph.npz or a g2o file is damaged, or of another "
                 "version", "", "save the map again, or use the kept `.bak`"),
    "E407": Code("map: keyframes", "keyframes.npz beside a map is damaged, or of another version",
                 "", "save the map again, or delete the file: the map works without it"),
    "E501": Code("log: kind", "the file is not a log that can be played, or lacks odometry or "
                 "scans", "robot: {use: replayed, log: notes.txt}",
                 "give a CARMEN log, a ROS bag or a sensors.mcap"),
    "E502": Code("log: damaged", "a message of the log is incomplete or has impossible values", "",
                 "remove the message, or record the log again"),
    "E413": Code("world: too large for a map",
                 "the map of the world would have too many cells; docs/worlds.md lists the limits",
                 "map: from_world",
                 "use `map: none`, larger cells, or closer `bounds` in the world file"),
    MISSING_PACKAGE: Code("installation", "the installation lacks a package or a driver that the "
                          "mission needs", "", "install it with the command of the message"),
    MISSING_DEVICE: Code("hardware", "a device that the robot's body needs is not there, is down, "
                         "or may not be used", "",
                         "connect it, or run the command of the message"),
    "E412": Code("start: collision", "the start is outside the world or inside an obstacle",
                 "start: [100, 100]", "start at one of the world's places"),
}  # fmt: skip
"""Codes of files, worlds, robots, maps and route graphs; see also missions.language.codes."""


def every_code() -> dict[str, Code]:
    """Return all codes of findings, sorted."""
    return dict(sorted({**FILE_CODES, **CODES}.items()))


def explanation(code: str) -> str:
    """Return cause, example and fix of a code as text: of a finding, or of a failure.

    Raises:
        InputError: unknown code.
    """
    known, name = every_code(), code.strip().upper()
    if name in FailureCode.__members__:
        return _failure(FailureCode(name))
    if name not in known:
        similar = [other for other in (*known, *FailureCode) if other[:2] == name[:2]]
        raise InputError(f"unknown code {code!r}; {suggestion(name, similar or list(known))}")
    found = known[name]
    severity = Finding(Mark(""), name, found.title).severity
    lines = [f"{name} ({severity}): {found.title}", "", f"cause    {found.cause}"]
    for number, line in enumerate(found.example.splitlines()):
        lines.append(f"{'example' if not number else '':<9}{line}")
    return "\n".join([*lines, f"fix      {found.fix}"])


def _failure(code: FailureCode) -> str:
    """The explanation of a failure, with the behaviours of treepilot that fail with it."""
    failing = [
        name for name, kind in find_behaviours().kinds.items() if code in (kind.fails_with or ())
    ]
    lines = [f"{code} (failure)", "", f"cause    {code.meaning}", f"fix      {code.remedy}"]
    return "\n".join([*lines, *([f"from     {', '.join(failing)}"] if failing else [])])
