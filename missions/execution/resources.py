"""Where missions, worlds and robots are found: by name among the shipped ones, or by path."""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from behaviours.catalogue import Catalogue, find_behaviours
from missions.execution.component_choices import chosen
from missions.execution.plugin_components import plugged_components
from missions.language.model import Component, Resources
from robots.load import find_robot, read_robot
from stack.documents import Finding, Findings, Mark, Node
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion
from stack.sim.import_world import read_any_world
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import find_world
from stack.types import OccupancyGrid

MISSIONS = Path(__file__).parents[1]
WORLDS = MISSIONS / "worlds"

SHOWN_VERSIONS = ("treepilot", "numpy", "numba", "pybullet", "opencv-python-headless", "py_trees")


def mission_files() -> list[Path]:
    """The shipped missions, in order."""
    return sorted(MISSIONS.glob("*.yaml"))


def world_files() -> list[Path]:
    """The shipped worlds, in order."""
    return sorted(WORLDS.glob("*.yaml"))


def find_mission(name_or_path: str | Path) -> Path:
    """A mission file by path, or a shipped one by name (`02_office_patrol`) or path.

    Raises:
        InputError: there is neither; the message names the nearest shipped one.
    """
    path = Path(name_or_path)
    shipped = {file.stem: file for file in mission_files()}
    if path.exists():
        return path
    stem = path.name.removesuffix(".yaml")
    if stem in shipped and path.parent.name in ("", "missions"):
        return shipped[stem]
    known = [file.name for file in (*shipped.values(), *path.parent.glob("*.yaml"))]
    hint = suggestion(path.name, known)
    raise InputError([Finding(Mark(str(path)), "E001", "there is no such mission file", hint)])


@lru_cache(maxsize=16)
def load_world(name_or_path: str, beside: Path) -> World:
    """A world by name or path; paths are relative to the mission's folder."""
    return read_any_world(find_world(name_or_path, beside, WORLDS))


@lru_cache(maxsize=16)
def load_robot(name_or_path: str, beside: Path) -> RobotDescription:
    """A robot by name or path; paths are relative to the mission's folder."""
    return read_robot(find_robot(name_or_path, beside))


def resources(world: str | None = None) -> Resources:
    """What reading a mission needs to know of the world, robot, map and components it names.

    Args:
        world: takes the place of the mission's own; a path is relative to the current folder.
    """
    return Resources(
        world_places=lambda name, beside: (
            (load_world(world, Path.cwd()) if world else load_world(name, beside)).places
        ),
        check_robot=lambda name, beside: _ignored(load_robot(name, beside)),
        check_map=lambda name, beside: _ignored(load_map(name, beside)),
        check_component=lambda kind, use, values: _ignored(
            chosen(kind, {**values, **({"use": use} if use else {})})
        ),
        plugged_components=plugged_components,
        nav2_components=_nav2_components,
    )


def catalogue_of(plugins: list[Node], beside: Path, findings: Findings) -> Catalogue:
    """The catalogue with a mission's plugins; what is wrong with them is found at their place."""
    catalogue = find_behaviours([str(node.value) for node in plugins], beside)
    for problem in catalogue.problems:
        if problem.plugin >= 0:  # what else is installed is no fault of this mission
            sentence = f"{_shown(problem.file, beside)}: {problem.sentence}"
            findings.error("E110", plugins[problem.plugin].mark, sentence)
    return catalogue


def load_map(name: str, beside: Path) -> OccupancyGrid:
    """A ROS map.yaml; the path is relative to the mission's folder."""
    from stack.mapping.ros_map import read_ros_map

    return read_ros_map(beside / name)


def _nav2_components(name: str, beside: Path) -> tuple[dict[str, Component], tuple[Finding, ...]]:
    """The components that a parameter file of Nav2 chooses, and what it says in vain."""
    from missions.nav2.reading import read_nav2
    from missions.nav2.reporting import components_of, warnings_of

    settings = read_nav2(beside / name)
    return components_of(settings), warnings_of(settings)


def _ignored(_: object) -> None:
    """A check needs no answer."""


def _shown(file: str, beside: Path) -> str:
    """A path as short as it can be said from the mission's folder."""
    path = Path(file)
    return str(path.relative_to(beside)) if path.is_relative_to(beside) else file


def versions() -> dict[str, str]:
    """Versions of treepilot and of what its results depend on."""
    found = {}
    for name in SHOWN_VERSIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
