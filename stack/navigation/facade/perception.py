"""Pictures, depth and detections for behaviours and displays."""

from __future__ import annotations

from stack.errors import ParameterError
from stack.navigation.facade.parts import FacadeParts
from stack.parameters import suggestion
from stack.perception.depth.cloud import point_cloud
from stack.types import (
    ColourMask,
    DepthImage,
    Detection,
    FloorLines,
    Image,
    LineColour,
    MarkerSighting,
    ObjectColour,
    Perceived,
    PlaceSighting,
    PointCloud,
)

SHOWN_FOR = 2.0
"""Seconds for which displays show what a search for a colour has found."""


class PerceptionFacade:
    """Members of the robot facade that answer from cameras and detectors."""

    def __init__(self, parts: FacadeParts) -> None:
        self._parts = parts
        self._perceived = Perceived(0.0, parts.estimator.estimate)

    def see(self, perceived: Perceived) -> None:
        """Answer from what a step has perceived, from now on."""
        self._perceived = perceived

    def image(self) -> Image | None:
        """The newest camera image since the camera was switched on; keeps it on.

        Images from before the camera was last off are not returned: they are out of date.
        """
        self._parts.camera.renew(self._parts.clock())
        image = self._perceived.newest("camera", Image)
        return image if image is not None and self._parts.camera.covers(image.stamp) else None

    def point_cloud(
        self, camera: str = "", *, voxel: float = 0.05, above: float | None = None
    ) -> PointCloud | None:
        """Points in the newest picture of a depth camera; keeps the depth cameras on."""
        known = self._parts.robot.depth_cameras
        name = camera or next(iter(known), "")
        if name not in known:
            if not known:
                raise ParameterError("camera", "the robot has no depth camera")
            raise ParameterError(
                "camera", f"unknown depth camera {name!r}", suggestion(name, known)
            )
        if not voxel > 0.0:
            raise ParameterError("voxel", f"expected more than 0 m, got {voxel:g}", "e.g. 0.05")
        lease = self._parts.depth_camera
        lease.renew(self._parts.clock())
        image = self._perceived.newest(name, DepthImage)
        if image is None or not lease.covers(image.stamp):
            return None
        return point_cloud(image, voxel=voxel, above=above)

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        """Known markers in the newest image; keeps the camera on like `image`."""
        image, detector = self.image(), self._parts.detector
        if image is None or detector is None:
            return ()
        return detector.sightings(image)

    @property
    def keyframes(self) -> int:
        """Number of keyframes of the map that pictures can be compared with."""
        return 0 if self._parts.places is None else self._parts.places.count

    def place_sightings(self) -> tuple[PlaceSighting, ...]:
        """Poses from which the newest image can have been taken; keeps the camera on."""
        image, places = self.image(), self._parts.places
        if image is None or places is None:
            return ()
        return places.sightings(image, self._parts.frames)

    def floor_lines(self, colour: LineColour, width: float) -> FloorLines | None:
        """Lines on the floor around the robot; keeps the camera on like `image`."""
        image, detector = self.image(), self._parts.floor_lines
        if image is None or detector is None or not self._parts.frames.covers(image.stamp):
            return None
        base = self._parts.frames.pose_at("odom", image.stamp)
        obstacles = self._perceived.motion.pose.transform(self._perceived.obstacles.points)
        return detector.see(image, base, colour, width, obstacles)

    def coloured_objects(self, colour: ObjectColour) -> tuple[Detection, ...] | None:
        """Objects of a colour on the floor; keeps the camera on like `image`."""
        image, detector = self.image(), self._parts.coloured_objects
        frames = self._parts.frames
        if image is None or detector is None or not frames.covers(image.stamp):
            return None
        ranges = self._perceived.motion.pose.transform(self._perceived.obstacles.points)
        ranges = frames.pose_at("odom", image.stamp).inverse().transform(ranges)
        return detector.detect(image, colour, frames.pose_at("map", image.stamp), ranges)

    def detections(self, label: str | None = None) -> tuple[Detection, ...] | None:
        """Objects in the newest searched picture; keeps detector and camera on."""
        objects = self._parts.objects
        found = None if objects is None else objects.detections(self._parts.clock())
        if found is None or label is None:
            return found
        return tuple(item for item in found if item.label == label)

    @property
    def seen_objects(self) -> tuple[Detection, ...]:
        """What detector and search for a colour found in recent pictures, for displays."""
        objects, coloured = self._parts.objects, self._parts.coloured_objects
        found = () if objects is None else objects.recent(self._parts.clock()) or ()
        if coloured is None:
            return found
        return (*found, *coloured.recent(self._parts.clock() - SHOWN_FOR))

    @property
    def colour_mask(self) -> ColourMask | None:
        """Pixels of the colour that was searched in a recent picture, for displays."""
        coloured = self._parts.coloured_objects
        mask = None if coloured is None else coloured.mask
        return mask if mask is not None and mask.stamp >= self._parts.clock() - SHOWN_FOR else None
