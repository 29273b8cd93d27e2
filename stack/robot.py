"""Interface of the robot for behaviours, by capability.

No call blocks. A call that takes time returns a task, which keeps its own outcome; a new motion
task cancels the previous one. Names follow nav2_simple_commander.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol, TypeVar

from stack.types import (
    Battery,
    Block,
    ContactZone,
    CoveragePlan,
    Detection,
    Failure,
    FloatArray,
    FloorLines,
    Footprint,
    Frontier,
    GraspPlan,
    GripperState,
    Image,
    JointState,
    JointTrajectory,
    LineColour,
    Marker,
    MarkerSighting,
    Measurement,
    ObjectColour,
    OccupancyGrid,
    Path,
    PlaceSighting,
    PointCloud,
    Pose2D,
    PoseEstimate,
    Scan,
    StandingObject,
    TaskStatus,
    TrackedObject,
    Twist,
)

M = TypeVar("M", bound=Measurement)

JsonValue = str | float | Sequence["JsonValue"] | Mapping[str, "JsonValue"]


class Task(Protocol):
    """A request to the robot that takes time. Keeps its own outcome."""

    @property
    def status(self) -> TaskStatus:
        """RUNNING until the task succeeds, fails or is cancelled; does not change after that."""

    @property
    def feedback(self) -> str:
        """Short progress text for the operator, e.g. `3.2 m to go`."""

    @property
    def failure(self) -> Failure | None:
        """Why it failed or was cancelled; None otherwise."""

    @property
    def distance_remaining(self) -> float:
        """Remaining distance, metres (radians for a spin); 0 if unknown or over."""

    @property
    def path(self) -> Path | None:
        """The current path, or the result of `plan`; None without one."""

    def cancel(self) -> None:
        """Cancel the task and stop the robot. Does nothing if the task is over."""


class Base(Protocol):
    """The drive of the robot: goals on the map, and motions by odometry and range sensors."""

    @property
    def odometry(self) -> Pose2D:
        """Dead-reckoned pose, odom frame: drifts but never jumps. For distances and turns."""

    @property
    def speed(self) -> Twist:
        """Measured velocity, base frame."""

    @property
    def footprint(self) -> Footprint:
        """Outline of the robot in the base frame."""

    def held(self, since: float) -> str:
        """What held the robot most since a time, seconds; empty if nothing did for long.

        A sentence for failures, as in: held 7.4 of 8.0 s: stopped: obstacle 0.3 m ahead.
        """

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> Task:
        """Plan and drive to a pose, with replanning when the world changes.

        Args:
            goal: map frame.
            tolerance: metres; None: the robot's own.
            partial: accept the nearest reachable pose as success.
        """

    def navigate_through(self, goals: list[Pose2D], *, tolerance: float | None = None) -> Task:
        """Drive through poses (map frame) in order, without stopping before the last one.

        Raises:
            ParameterError: no goals.
        """

    def follow_path(self, path: Path) -> Task:
        """Drive along a path (map frame), without replanning.

        Raises:
            ParameterError: the path has fewer than two points.
        """

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> Task:
        """Plan without driving; the result is the task's `path`.

        Args:
            goal: map frame.
            start: map frame; None: the robot's pose.
        """

    def spin(self, angle: float, *, speed: float | None = None, while_lost: bool = False) -> Task:
        """Turn in place by an angle, radians, positive to the left; may exceed a full turn.

        This motion and the next three fail with LOST while the robot is lost, and so does
        `drive_for`. A behaviour that finds the pose sets `while_lost`.
        """

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> Task:
        """Drive straight back by a distance, metres; fails before it touches an obstacle.

        Raises:
            ParameterError: a distance or speed that is not above 0, or a robot that cannot reverse.
        """

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> Task:  # fmt: skip
        """Drive straight by a distance, with the heading held by odometry.

        Fails before it touches an obstacle that a sensor sees.

        Args:
            distance: metres; negative: backward.
            speed: m/s; None: the robot's own.
            direction: of travel in the base frame, radians; omnidirectional robots only.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a speed that is not above 0.
        """

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> Task:  # fmt: skip
        """Drive out of a tight spot by range sensors and odometry, without costmap, map or pose.

        Sensors do not see keep-out zones. A robot that knows where it is stays out of them, and
        drives out of one in which it stands on the map.

        Args:
            clearance: required free distance around the footprint, metres; None: the robot's own.
            distance: maximum driving distance, metres.
            speed: m/s; None: the robot's own.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a value that is not above 0.
        """

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> Task:
        """Let the operator drive, limited by safety. Succeeds when the operator is done.

        Args:
            seconds: time limit; fails with TIMED_OUT after that.
            silence: seconds without a velocity from the operator after which it fails.
        """

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> Task:  # fmt: skip
        """Drive a velocity for some seconds, for behaviours with their own control loop.

        Safety still limits the velocity. Cancels the current motion task; a call while the last one
        is driven renews that one's task, which succeeds when the time is over.

        Args:
            twist: base frame.
            seconds: after which the robot stops, unless the call is repeated.
            while_lost: drive also while the robot is lost.
            contact: where the robot may touch something, such as a dock: what the sensors see there
                does not stop it, and it drives slowly.
            gives_way: leave the way of a person who walks towards the robot, as drives do.

        Raises:
            NavigationError: LOST, while the robot is, unless `while_lost` is set or the twist is
                standstill. A behaviour that does not catch it fails with LOST.
        """

    def disambiguate(self) -> Task:
        """Drive to where the estimate and its rivals differ until one pose is left.

        Succeeds at once without rivals. Fails with AMBIGUOUS when no reachable place differs.
        """

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Close or open an edge of the planner's route graph; a current drive replans.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """


class Localisation(Protocol):
    """Where the robot is, and how it finds its pose."""

    @property
    def estimate(self) -> PoseEstimate:
        """Pose in the map frame with covariance and health of the localisation."""

    @property
    def pose(self) -> Pose2D:
        """Estimated pose of the robot, map frame."""

    @property
    def health(self) -> float:
        """Calibrated probability in [0, 1] that the pose is within 0.3 m and 10 degrees."""

    def fit_at(self, pose: Pose2D) -> float:
        """Health in [0, 1] that localisation would have with the newest scan at this pose."""

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Reset the localisation to a pose with uncertainty.

        Args:
            pose: map frame.
            position_deviation: standard deviation of the position, metres.
            heading_deviation: standard deviation of the heading, radians.
            source: origin of the pose for the report, e.g. `marker`.
        """

    def relocalise(self) -> Task:
        """Find the pose anywhere on the map from the lidar.

        Fails with AMBIGUOUS if other poses explain the scans as well; `estimate.rivals` has them.
        """


class Map(Protocol):
    """What is known of the surroundings, and the costmaps for planning."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map so far: the estimator's, else the mission's, else what the costmap has sensed."""

    @property
    def known_area(self) -> float:
        """Area of the map's free and occupied cells, square metres."""

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The known markers of the map, map frame."""

    def frontiers(
        self, *, sensor_range: float = 6.0, least_size: float = 0.4, least_gain: float = 0.25,
        avoided: Sequence[Pose2D] = (), seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        """Places where the robot can see unknown space, the nearest first; takes milliseconds.

        Args:
            sensor_range: distance at which a view shows unknown space, metres.
            least_size: shorter frontiers are ignored, metres.
            least_gain: views that show less are ignored, square metres.
            avoided: views that are not returned again, for example because no way leads there.
            seen_from: places where the robot has looked around; what the map does not show to be
                in view of them counts as unknown. None: only what the map does not know.
        """

    def coverage(
        self, corners: list[Pose2D], spacing: float, *, clearance: float | None = None
    ) -> CoveragePlan:
        """Lanes that cover an area; takes milliseconds.

        Args:
            corners: of a polygon, map frame; empty: the room in which the robot is.
            spacing: distance of two lanes, metres.
            clearance: of the robot's centre from obstacles, metres; None: the robot's own.
        """

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Clear sensed obstacles from the costmaps. The static map is kept.

        Args:
            which: `local`, `global` or `both`.
            radius: clear only within this distance of the robot, metres; None: everywhere.
            layer: clear only this layer; None: all layers.

        Raises:
            ParameterError: unknown costmap or layer.
        """

    def save(self, name: str) -> str:
        """Save the map as a folder, with its keyframes and pose graph if any; return its name.

        Args:
            name: a path relative to the run folder, or an absolute one.

        Raises:
            NavigationError: FAILED if it cannot be written or its markers cannot be computed.
        """

    def load(self, name: str, pose: Pose2D | None = None) -> None:
        """Load a saved map and use it from now on.

        Args:
            name: a folder or map.yaml; relative to the run folder or else to the mission's folder.
            pose: of the robot in that map; None: unknown.

        Raises:
            NavigationError: FAILED if the files are wrong, UNSUPPORTED if the estimator cannot
                change its map.
        """

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to change the map; the robot localises itself on it in either case.

        Raises:
            NavigationError: the estimator draws no map.
        """


class Perception(Protocol):
    """What sensors see: scans, moving objects, pictures and what is found in them."""

    @property
    def scan(self) -> Scan | None:
        """The newest scan of the lidar that the localisation uses; None without one."""

    @property
    def tracks(self) -> tuple[TrackedObject, ...]:
        """Moving objects around the robot, such as people, at `time`; map frame.

        Who has moved and stands still now is one of them. An object that is out of sight is
        expected where its velocity takes it for a second, with a growing covariance; then it is
        forgotten. It gets another id when it is seen again.
        """

    @property
    def standing_objects(self) -> tuple[StandingObject, ...]:
        """Objects in the newest scan that are not on the map and have not moved; map frame.

        Round things up to the tracker's `largest_radius`, and people who stood already when they
        were seen first: a scan does not tell which. Who begins to move is one of `tracks` from then
        on, with the same id. Out of sight, they get another id when they are seen again.
        """

    def image(self) -> Image | None:
        """The newest camera picture; each call keeps the camera on for another second."""

    def point_cloud(
        self, camera: str = "", *, voxel: float = 0.05, above: float | None = None
    ) -> PointCloud | None:
        """Points in the newest picture of a depth camera, one for each voxel; takes a millisecond.

        Each call keeps the depth cameras on for another second. None before the first picture.

        Args:
            camera: name of the depth camera; empty: the robot's first.
            voxel: side of a voxel, metres; a point is the mean of those in its voxel.
            above: height above the floor in metres up to which points are left out, such as 0.04
                to remove the floor; None: keep all.

        Raises:
            ParameterError: the robot has no such depth camera.
        """

    def newest(self, name: str, kind: type[M]) -> M | None:
        """The newest measurement of a sensor, also of a type that a package brings.

        Args:
            name: of the sensor.
            kind: of the measurement, for example Imu. None before the first one of this type.
        """

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        """Known markers in the newest picture; keeps the camera on, as `image` does."""

    @property
    def keyframes(self) -> int:
        """Number of keyframes of the map that pictures can be compared with; 0 without any."""

    def place_sightings(self) -> tuple[PlaceSighting, ...]:
        """Poses from which the newest picture can have been taken, by the keyframes of the map.

        Those that explain most of the picture come first. Keeps the camera on, as `image` does.
        """

    def floor_lines(self, colour: LineColour, width: float) -> FloorLines | None:
        """Lines on the floor around the robot; keeps the camera on, as `image` does.

        None before the first picture, and when the newest one is out of date.

        Args:
            colour: of the lines; `dark` and `light` are relative to the floor.
            width: of the lines, metres.
        """

    def coloured_objects(self, colour: ObjectColour) -> tuple[Detection, ...] | None:
        """Objects of a colour on the floor, the nearest first; keeps the camera on, as `image`.

        None before the first picture, and when the newest one is out of date.
        """

    def blocks(self, camera: str = "") -> tuple[Block, ...] | None:
        """Blocks in the newest pictures of the colour camera and a depth camera.

        Each call keeps the cameras on for another second. None before the first pair of pictures,
        and while the newest ones are not of the same time. Takes some 0.2 s for new pictures.

        Args:
            camera: name of the depth camera; empty: the robot's first.

        Raises:
            ParameterError: the robot has no such depth camera, or no colour camera.
        """

    @property
    def hand_camera(self) -> str:
        """Name of the depth camera on a moving link; empty: the robot has none."""

    def look_closer(self, block: Block, since: float) -> Block | None:
        """A block where the depth camera in the hand shows it, which must be above it.

        A camera that shows things always to the same side of where they are found from near is
        reported, by an event `calibration` with the offset.

        Args:
            block: as `blocks` returned it.
            since: time of the picture at least, seconds: nothing has moved since.

        Returns:
            None before such a picture, and if the block is not seen whole.
        """

    def is_gone(self, block: Block, camera: str = "") -> bool:
        """Whether the newest depth picture shows that a block is not at its place.

        What is hidden is not gone; nor is anything as long as there is no picture.

        Args:
            block: as `blocks` returns it.
            camera: name of the depth camera; empty: the robot's first.

        Raises:
            ParameterError: the robot has no such depth camera.
        """

    def detections(self, label: str | None = None) -> tuple[Detection, ...] | None:
        """Objects in the newest picture that the object detector searched, the nearest first.

        Each call keeps detector and camera on for another second. None before the first result,
        when the newest one is out of date, and without a detector.

        Args:
            label: of the objects; None: all.
        """


class GraspTask(Task, Protocol):
    """A search for grasps of a block."""

    @property
    def grasps(self) -> tuple[GraspPlan, ...]:
        """The grasps, the best first; none before the end."""


class Arm(Protocol):
    """The arm of the robot: joints, motions, and what the arm must not touch.

    Poses are (4, 4) in the arm's base link, metres. Motions to a goal are planned without contact
    once the arm stands: with the boxes of the world, the blocks of `see` and what the hand holds.
    They fail with UNREACHABLE, NO_MOTION_PLAN, START_OCCUPIED, GOAL_OCCUPIED or COLLISION_AHEAD if
    there is no motion, and with ARM_COLLISION if the arm stops by itself.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """URDF names of the joints, from the base to the hand."""

    @property
    def postures(self) -> Mapping[str, FloatArray]:
        """Named positions (n,) of the joints, radians; `home` is always one."""

    @property
    def joints(self) -> JointState | None:
        """The newest measurement; None before the first one."""

    @property
    def tool_pose(self) -> FloatArray | None:
        """Measured pose of the tool; None as for `joints`."""

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks around the arm by name, as `see` and `release` have left them."""

    @property
    def held(self) -> Block | None:
        """The block in the hand, where it is now; None without one."""

    def box(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return pose and size (3,) of a box of the world.

        Raises:
            ParameterError: there is none.
        """

    def see(self, blocks: Iterable[Block], gone: Iterable[Block] = ()) -> tuple[Block, ...]:
        """Take what a look around has shown.

        A known block stays known, unless it is gone or a new one is at its place: it may be hidden.

        Args:
            blocks: that were found.
            gone: known ones that are not at their places any more.

        Returns:
            Those that were found, without the one in the hand and without parts of boxes.
        """

    def hold(self, block: Block, width: float) -> None:
        """The hand has grasped a block; it moves with the tool.

        Args:
            block: from its place before the grasp.
            width: between the fingers, metres.
        """

    def release(self, *, lost: bool = False) -> None:
        """The hand holds nothing any more: its block stands where the tool is, or is lost."""

    def move_joints(self, positions: FloatArray, *, speed: float = 1.0) -> Task:
        """Move the joints to positions.

        Args:
            positions: (n,) radians.
            speed: share of the top speed.

        Raises:
            ParameterError: the number of positions is wrong.
        """

    def move_to_posture(self, name: str, *, speed: float = 1.0) -> Task:
        """Move to a named posture.

        Raises:
            ParameterError: the arm has no such posture.
        """

    def move_tool(
        self, pose: FloatArray, *, straight: bool = False, touching: Iterable[Block | str] = (),
        speed: float = 1.0,
    ) -> Task:  # fmt: skip
        """Move the tool to a pose.

        Args:
            pose: of the tool.
            straight: along a line, with an even turn.
            touching: blocks, or names of boxes, that the fingers and what they hold may touch.
            speed: share of the top speed.
        """

    def plan_grasps(self, block: Block) -> GraspTask:
        """Look for grasps of a block; fails with NO_MOTION_PLAN if there is none."""

    def follow(self, trajectory: JointTrajectory) -> Task:
        """Move along a trajectory that begins where the arm is and ends at rest.

        Raises:
            ParameterError: it begins elsewhere, goes beyond the limits of a joint, or does not end
                at rest.
        """


class Gripper(Protocol):
    """The gripper of the robot."""

    @property
    def state(self) -> GripperState | None:
        """The newest measurement; None before the first one."""

    @property
    def width_max(self) -> float:
        """Distance between the open fingers, metres."""

    def move(self, width: float, force: float | None = None) -> Task:
        """Move the fingers until they reach a width or hold something; both are a success.

        Args:
            width: distance between the fingers, metres.
            force: with which they press at most, N; None: the largest.

        Raises:
            ParameterError: the gripper cannot open so wide, or press so hard.
        """


class Robot(Protocol):
    """Interface of the robot for behaviours: its capabilities, its clock, its operator.

    A behaviour that asks a capability of a robot without it finds nothing: `needs` of the behaviour
    lets `check` refuse such a mission.
    """

    @property
    def base(self) -> Base:
        """Its drive."""

    @property
    def localisation(self) -> Localisation:
        """Where it is."""

    @property
    def map(self) -> Map:
        """What it knows of its surroundings."""

    @property
    def arm(self) -> Arm:
        """Joints and motions of the arm.

        Raises:
            ParameterError: the robot has none.
        """

    @property
    def gripper(self) -> Gripper:
        """The gripper.

        Raises:
            ParameterError: the robot has none.
        """

    @property
    def perception(self) -> Perception:
        """What its sensors see."""

    @property
    def time(self) -> float:
        """Seconds on the robot's clock: simulated time in simulation."""

    @property
    def battery(self) -> Battery:
        """State of charge."""

    @property
    def recording_over(self) -> bool:
        """Whether all measurements of a replayed log have been played; else false."""

    def save_image(
        self, image: Image, name: str, *, details: Mapping[str, JsonValue] | None = None
    ) -> str:
        """Save a picture in the run's folder; returns its path relative to that folder.

        Args:
            image: to save.
            name: of the file, without suffix.
            details: saved beside the picture as a JSON file of the same name.
        """

    def say(self, text: str) -> None:
        """Show a text to the operator; recorded in the event log."""
