"""`treepilot frames`: the tree of frames of a robot, or of a recorded run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from missions.execution.prepare import prepare
from missions.execution.records.inputs import read_inputs
from missions.execution.resources import load_robot
from missions.inspection.run_folders import NEWEST, find_run, is_run_folder
from robots.load import robot_names
from stack.columns import columns
from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import InputError
from stack.telemetry.records import Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import Pose2D

MAP, ODOM = "map", "odom"
LOCALISATION, ODOMETRY, JOINTS = "localisation", "odometry", "joints"


@dataclass(frozen=True)
class Frame:
    """A frame in the tree.

    Attributes:
        name: of the frame.
        parent: frame above it; empty for the topmost one.
        motion: fixed, or how it moves.
        publisher: who says where it is.
    """

    name: str
    parent: str
    motion: str = "fixed"
    publisher: str = "robot file"


@dataclass
class Published:
    """What a publisher said in a run.

    Attributes:
        stamps: of the records in which it changed or was measured again, s.
    """

    stamps: list[float] = field(default_factory=list)

    def rate(self) -> str:
        """Records per second; empty with fewer than two."""
        if len(self.stamps) < 2 or self.stamps[-1] == self.stamps[0]:
            return ""
        return f"{(len(self.stamps) - 1) / (self.stamps[-1] - self.stamps[0]):.1f} Hz"

    def age(self, end: float) -> str:
        """Seconds since the newest one at the end of the run; empty without any."""
        return f"{end - self.stamps[-1]:.2f} s" if self.stamps else ""


def frame_lines(named: str, folder: Path, runs: Path) -> list[str]:
    """Return the tree of a robot or of a run, line by line.

    Args:
        named: a robot, its file, a run folder, or a name of one in `runs`.
        folder: to which paths are relative.
        runs: where run folders are.

    Raises:
        InputError: there is neither such a robot nor such a run.
    """
    if named in robot_names() or Path(named).suffix in (".yaml", ".yml"):
        return _drawn(robot_frames(load_robot(named, folder)), {}, 0.0)
    try:
        run = Path(named) if is_run_folder(Path(named)) else find_run(named or NEWEST, runs)
    except InputError as error:
        known = ", ".join(robot_names())
        raise InputError(f"{named!r} is neither a run ({error}) nor a robot ({known})") from None
    return _of_run(run)


def robot_frames(robot: RobotDescription) -> list[Frame]:
    """Return base, links and sensors of a robot, parents first."""
    frames = [Frame(BASE, "")]
    for joint in robot.links:
        driven = robot.arm is not None and joint.name in robot.arm.all_joints
        moves = joint.kind != "fixed"
        frames.append(
            Frame(
                joint.child, joint.parent, f"{joint.kind} {joint.name}" if moves else "fixed",
                JOINTS if driven else "nobody: drawn at 0" if moves else "URDF",
            )
        )  # fmt: skip
    known = {frame.name for frame in frames}
    for name, (parent, what) in _sensors(robot).items():
        unique = name if name not in known else f"{name} ({what})"
        frames.append(Frame(unique, parent, f"fixed, {what}"))
    return frames


def _sensors(robot: RobotDescription) -> Mapping[str, tuple[str, str]]:
    """Return the frame that carries each sensor, and its kind, by name."""
    found: dict[str, tuple[str, str]] = {
        **{name: (BASE, "lidar") for name in robot.real_lidars},
        **{name: (BASE, "sonar") for name in robot.sonars},
    }
    if robot.camera is not None:
        found["camera"] = robot.camera.link or BASE, "camera"
    for name, camera in robot.depth_cameras.items():
        found[name] = camera.link or BASE, "depth camera"
    if robot.imu is not None:
        found["imu"] = BASE, "IMU"
    return found


def _of_run(run: Path) -> list[str]:
    inputs = read_inputs(run)
    robot = prepare(inputs.mission, inputs.options).robot
    with SnapshotRecording(run) as recording:
        published, end = _published(
            recording.snapshot(number, whole=False) for number in range(len(recording.times))
        )
    _, *below = robot_frames(robot)
    above = [Frame(MAP, "")]
    if robot.drivetrain.moves:
        above += [Frame(ODOM, MAP, "moves", LOCALISATION), Frame(BASE, ODOM, "moves", ODOMETRY)]
    else:
        above.append(Frame(BASE, MAP, "fixed", "mission"))
    frames = [*above, *below]
    return _drawn(frames, published, end)


def _published(snapshots: Iterator[Snapshot]) -> tuple[dict[str, Published], float]:
    """Return who said something when, by publisher, and the time of the last snapshot."""
    found = {name: Published() for name in (LOCALISATION, ODOMETRY, JOINTS)}
    end, last = 0.0, Pose2D(0.0, 0.0)
    for snapshot in snapshots:
        end = snapshot.time
        found[ODOMETRY].stamps.append(end)
        correction = snapshot.pose.compose(snapshot.odometry.inverse())
        if not found[LOCALISATION].stamps or correction.distance_to(last) > 1e-9:
            found[LOCALISATION].stamps.append(end)
        last = correction
        if snapshot.arm is not None:
            found[JOINTS].stamps.append(end)
    return found, end


def _drawn(
    frames: Sequence[Frame], published: Mapping[str, Published], end: float
) -> list[str]:  # fmt: skip
    """Return the tree with a line for each frame; rates and ages are those of its publisher."""
    below: dict[str, list[Frame]] = {}
    for frame in frames:
        below.setdefault(frame.parent, []).append(frame)
    rows: list[list[str]] = []

    def add(frame: Frame, indent: str, branch: str, deeper: str) -> None:
        said = published.get(frame.publisher, Published())
        rows.append([
            f"{indent}{branch}{frame.name}", frame.motion if frame.parent else "",
            frame.publisher if frame.parent else "", said.rate(), said.age(end),
        ])  # fmt: skip
        children = below.get(frame.name, [])
        for number, child in enumerate(children, 1):
            is_last = number == len(children)
            add(child, indent + deeper, "└─ " if is_last else "├─ ", "   " if is_last else "│  ")

    for top in below.get("", []):
        add(top, "", "", "")
    heads = ["frame", "in its parent", "published by"]
    heads += ["rate", "age"] if published else ["", ""]
    return [line.rstrip() for line in columns([heads, *rows])]
