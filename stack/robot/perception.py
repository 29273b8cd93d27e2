"""What the sensors of the robot see, for behaviours."""

from __future__ import annotations

from typing import Protocol, TypeVar

from stack.types import (
    Block,
    Detection,
    FloorLines,
    Image,
    LineColour,
    MarkerSighting,
    Measurement,
    ObjectColour,
    PlaceSighting,
    PointCloud,
    Scan,
    StandingObject,
    TrackedObject,
)

M = TypeVar("M", bound=Measurement)


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

        Their poses are relative to the base now: it may have moved since the pictures were taken.
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
