"""Find and load missions, worlds, robots and maps: shipped ones by name, others by path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from behaviours.catalogue import Catalogue, find_behaviours
from missions.execution.component_choices import NAVIGATION_KINDS, accepted_parameters, chosen
from missions.execution.plugin_components import plugged_components
from missions.language.model import Component, Mission, Replay, Resources
from missions.language.reading.include import BESIDE
from missions.language.sections import mission_words
from robots.load import find_robot, read_robot
from robots.logs.opening import MCAP, beginning, open_log
from robots.logs.recording import SENSOR_LOG, Recording
from robots.logs.rosbag import Topics
from stack.documents import Finding, Findings, Mark, Node
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.mapping.limits import FARTHEST
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.parameters import did_you_mean, nearest
from stack.sim.faults.planned import PlannedFault
from stack.sim.import_world import GAZEBO, read_any_world
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import find_world
from stack.telemetry.sensor_log import is_sensor_log, read_about, read_observations
from stack.types import Marker, OccupancyGrid, Pose2D

MISSIONS = Path(__file__).parents[1]
WORLDS = MISSIONS / "worlds"

SHOWN_VERSIONS = ("treepilot", "numpy", "numba", "pybullet", "opencv-python-headless", "py_trees")


def mission_files() -> list[Path]:
    """Return the shipped missions, sorted by name."""
    return sorted(MISSIONS.glob("*.yaml"))


def world_files() -> list[Path]:
    """Return the shipped worlds, sorted by name."""
    return sorted(WORLDS.glob("*.yaml"))


def find_mission(name_or_path: str | Path) -> Path:
    """Return a mission file by path, or a shipped one by name (`02_office_patrol`).

    Raises:
        InputError: the file does not exist; the message suggests the most similar name.
    """
    path = Path(name_or_path)
    shipped = {file.stem: file for file in mission_files()}
    try:
        if path.exists():
            return path
    except OSError as error:
        sentence = f"cannot be read: {error.strerror}"
        raise InputError([Finding(Mark(str(path)), "E001", sentence)]) from None
    stem = path.name.removesuffix(".yaml")
    if stem in shipped and path.parent.name in ("", "missions"):
        return shipped[stem]
    hint, sentence = _near(path, shipped), "no such mission file"
    if path.is_symlink():
        sentence = f"this is a broken link: there is no {str(path.readlink())!r}"
    raise InputError([Finding(Mark(str(path)), "E001", sentence, hint)])


def _near(path: Path, shipped: Mapping[str, Path]) -> str:
    """Return a hint with the most similar file in the same folder, or shipped mission.

    Only stems are compared: a common suffix makes any two file names similar.
    """
    if not path.parent.is_dir():
        return f"there is no folder {str(path.parent)!r}"
    known = {name: name for name in shipped} | {
        file.stem: str(file) for file in sorted(path.parent.glob("*.yaml")) if file.is_file()
    }
    close = nearest(path.stem, list(known))
    if close is not None:
        return did_you_mean(known[close])
    return "give the path of a mission file, or a name from `treepilot list missions`"


def base_folder(option: str | None, mission_folder: Path) -> Path:
    """Return the base of a relative path: the current folder for an option, else the mission's."""
    return Path.cwd() if option else mission_folder


def load_world(name_or_path: str, folder: Path) -> World:
    """Load a world by name or path; a path is relative to the mission's folder."""
    return read_any_world(find_world(name_or_path, folder, WORLDS))


def load_robot(name_or_path: str, folder: Path) -> RobotDescription:
    """Load a robot by name or path; a path is relative to the mission's folder."""
    return read_robot(find_robot(name_or_path, folder))


class SceneFiles:
    """The robots and worlds of one preparation: each file is read once, however often it is named.

    The reader of the mission checks them, and the scene is made of them.
    """

    def __init__(self) -> None:
        self._robots: dict[Path, RobotDescription] = {}
        self._worlds: dict[tuple[Path, Pose2D | None], World] = {}

    def robot(self, name_or_path: str, folder: Path) -> RobotDescription:
        """Return a robot, as `load_robot` does."""
        file = find_robot(name_or_path, folder)
        if file not in self._robots:
            self._robots[file] = read_robot(file)
        return self._robots[file]

    def world(self, name_or_path: str, folder: Path, start: Pose2D | None = None) -> World:
        """Return a world as `load_world` does; `start` is that of `read_any_world`."""
        file = find_world(name_or_path, folder, WORLDS)
        key = file, start if file.suffix in GAZEBO else None  # others do not depend on the start
        if key not in self._worlds:
            self._worlds[key] = read_any_world(file, start)
        return self._worlds[key]


@lru_cache(maxsize=4)
def _opened_log(path: Path, topics: Topics, state: tuple[tuple[str, int, int], ...]) -> Recording:
    """Open a log once while it does not change (`state`: names, times and sizes of its files)."""
    return open_log(path, topics)


def _state_of(log: Path) -> tuple[tuple[str, int, int], ...]:
    """Return name, modification time (ns) and size of the files of a log, which may be a folder."""
    try:
        files = sorted(log.iterdir()) if log.is_dir() else [log]
        states = [(file.name, file.stat()) for file in files]
    except OSError:
        return ()
    return tuple((name, state.st_mtime_ns, state.st_size) for name, state in states)


def open_recording(path: Path, replay: Replay | None = None) -> Recording:
    """Open a sensor log of treepilot, a CARMEN log or a ROS bag.

    Args:
        path: of the log.
        replay: with the topics of a ROS bag; None: the usual ones.

    Raises:
        InputError: missing, of another kind, or damaged.
    """
    is_mcap = path.suffix == ".mcap" and not path.is_dir()
    if is_mcap and (not beginning(path).startswith(MCAP) or is_sensor_log(path)):
        return _sensor_log(path)
    topics = Topics() if replay is None else Topics(replay.lidars, replay.odometry, replay.imu)
    return _opened_log(path.absolute(), topics, _state_of(path))


def _sensor_log(path: Path) -> Recording:
    """Return the recording of a run of treepilot; its robot is the one of that run."""
    return Recording(
        path, SENSOR_LOG, 0.0, 0.0, {}, {}, lambda: read_observations(path), about=read_about(path)
    )


def recorded_world(name: str) -> World:
    """Return a world without obstacles, in which a log is played."""
    return World(name, (-FARTHEST, -FARTHEST, FARTHEST, FARTHEST))


def resources(world: str | None = None, files: SceneFiles | None = None) -> Resources:
    """Return the checks and look-ups that the mission reader calls for the names in a mission.

    Args:
        world: replaces the mission's world; a path is relative to the current folder.
        files: read robots and worlds.
    """
    files = files or SceneFiles()
    return Resources(
        navigation_kinds=NAVIGATION_KINDS,
        world_places=lambda name, folder: (
            files.world(world or name, base_folder(world, folder)).places
        ),
        check_robot=lambda name, folder: _ignore(files.robot(name, folder)),
        check_map=lambda name, folder: _ignore(load_map(name, folder)),
        check_markers=lambda name, folder: _ignore(read_marker_map(folder / name)),
        check_component=lambda kind, use, values, mapped: _ignore(
            chosen(kind, use, values, mapped=mapped)
        ),
        plugged_components=plugged_components,
        nav2_components=_nav2_components,
        accepted_parameters=accepted_parameters,
        faults=_read_faults,
    )


def _read_faults(
    nodes: Sequence[Node], findings: Findings, places: Mapping[str, Pose2D]
) -> tuple[PlannedFault, ...]:
    from stack.sim.faults.reading import read_faults  # few missions have faults

    return read_faults(nodes, findings, places)


def catalogue_of(plugins: list[Node], folder: Path, findings: Findings) -> Catalogue:
    """Return the catalogue with a mission's plugins; report their problems as findings."""
    catalogue = find_behaviours([str(node.value) for node in plugins], folder, mission_words())
    for problem in catalogue.problems:
        if problem.plugin >= 0:  # problems of installed packages are not the mission's
            sentence = f"{_shown(problem.file, folder)}: {problem.sentence}"
            named = plugins[problem.plugin]
            is_absent = "/" in str(named.value) and not (folder / str(named.value)).exists()
            findings.add("E110", named.mark, sentence, BESIDE if is_absent else "")
    return catalogue


def load_map(name: str, folder: Path) -> OccupancyGrid:
    """Load a ROS map.yaml, or the one in the folder of a saved map.

    The path is relative to the mission's folder.
    """
    from stack.mapping.ros_map import read_ros_map

    path = folder / name
    return read_ros_map(path / "map.yaml" if path.is_dir() else path)


def map_folder(name: str, folder: Path) -> Path | None:
    """Return the folder of a mission's map; None for `from_world` and `none`."""
    if name in ("from_world", "none"):
        return None
    path = folder / name
    return path if path.is_dir() else path.parent


def known_markers(mission: Mission, world: World) -> tuple[Marker, ...]:
    """Return the markers that the robot knows: the mission's, its saved map's, else the world's.

    Raises:
        InputError: the map of markers has errors.
    """
    folder = mission.source.parent
    if mission.markers == "none":
        return ()
    if mission.markers not in ("", "from_world"):
        return read_marker_map(folder / mission.markers)
    saved = map_folder(mission.map, folder)
    if not mission.markers and saved is not None and (saved / MARKERS_YAML).is_file():
        return read_marker_map(saved / MARKERS_YAML)
    return world.markers


def _nav2_components(
    name: str, namespace: str | None, folder: Path
) -> tuple[dict[str, Component], tuple[Finding, ...]]:
    """Return the components of a Nav2 parameter file, and warnings for settings without effect."""
    from missions.nav2.reading import read_nav2
    from missions.nav2.reporting import components_of, warnings_of

    settings = read_nav2(folder / name, namespace=namespace)
    return components_of(settings), warnings_of(settings)


def _ignore(_: object) -> None:
    """Drop the result of a load that is done only for its checks."""


def _shown(file: str, folder: Path) -> str:
    """Return a path relative to the mission's folder if it is inside it."""
    path = Path(file)
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else file


def versions() -> dict[str, str]:
    """Return the versions of treepilot and of the libraries its results depend on."""
    return {name: _version_of(name) for name in SHOWN_VERSIONS}


@cache
def _version_of(name: str) -> str:
    """Return the version of a distribution that is installed; it takes 1 ms to find."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
