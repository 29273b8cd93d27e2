"""Whether this installation has what a mission needs: optional packages, OpenGL."""

from __future__ import annotations

from collections.abc import Iterator

from missions.execution.fit.components import Marks
from robots.bodies import lack_of
from stack.components import Choice, Component, noun
from stack.documents import Finding, Mark, Node, read_file
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.optional_packages import MISSING_DEVICE, MISSING_PACKAGE


def check_packages(choices: dict[str, Choice], marks: Marks) -> None:
    """Raise InputError for components whose packages are not installed."""
    found = []
    for choice in choices.values():
        packages = choice.component.packages if issubclass(choice.component, Component) else ()
        for package in packages:
            if not package.is_installed:
                mark = marks.of_component(choice.kind)
                sentence = f"the {noun(choice.kind)} {choice.name!r} needs {package.absence}"
                found.append(Finding(mark, MISSING_PACKAGE, sentence, package.hint))
    if found:
        raise InputError(found)


def check_body(robot: RobotDescription, choice: str) -> list[Finding]:
    """Return what this machine lacks for the body; a device that is not there is a warning.

    Args:
        robot: with its choice of a body.
        choice: of the command line; empty: the robot's.
    """
    lack = lack_of(robot, choice)
    if lack is None:
        return []
    file = None if robot.source is None else read_file(robot.source, "robot")
    code = MISSING_DEVICE if lack.is_device else MISSING_PACKAGE
    return [Finding(_mark(robot, file, "body"), code, lack.sentence, lack.remedy)]


def check_renderer(robot: RobotDescription, option: str) -> None:
    """Raise InputError for cameras that must be drawn by OpenGL where it cannot be used.

    Args:
        robot: with its simulated cameras.
        option: the renderer of the command line; empty: the choice of the robot file.
    """
    cameras = dict(_drawn_by_opengl(robot))
    if not cameras:
        return
    from stack.sim.sensors.gl_trial import opengl_problem

    problem = opengl_problem()
    if not problem:
        return
    if option:
        raise InputError(f"--renderer {option}: {problem}; or use --renderer auto")
    hint = "write `renderer: auto` to draw by OpenGL only where it works"
    raise InputError(
        [
            Finding(mark, MISSING_PACKAGE, f"{name}: renderer: {problem}", hint)
            for name, mark in cameras.items()
        ]
    )


def _drawn_by_opengl(robot: RobotDescription) -> Iterator[tuple[str, Mark]]:
    """Yield the names of the cameras that ask for OpenGL, and where the robot file does."""
    file = None if robot.source is None else read_file(robot.source, "robot")
    if robot.camera is not None and robot.camera.renderer == "gl":
        yield "camera", _mark(robot, file, "camera", "renderer")
    for name, camera in robot.depth_cameras.items():
        if camera.renderer == "gl":
            yield name, _mark(robot, file, "depth_cameras", name, "renderer")


def _mark(robot: RobotDescription, file: Node | None, *keys: str) -> Mark:
    """Return the position of a value of the robot file; its start if it is not written there."""
    node = file
    for key in keys:
        node = None if node is None else node.get(key)
    return Mark(str(robot.source)) if node is None else node.mark
