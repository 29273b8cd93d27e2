"""Sensing stage of the step loop: what the body has measured, and which of it can be used."""

from __future__ import annotations

from collections.abc import Sequence

from stack.body import HEALTHY, BodyHealth, Replay
from stack.frames.deskew import Deskewer
from stack.perception.cameras.watch import COLOUR_CAMERA
from stack.perception.frozen_scans import FrozenScans
from stack.perception.own_body import OwnBody
from stack.perception.sensor_watch import SensorEvent, SensorWatch
from stack.runtime.interfaces import LoopParts
from stack.runtime.sensor_rates import SensorRates
from stack.telemetry.hub import SENSORS, reason_of
from stack.types import DepthImage, Image, Observation, Pose2D, SensorState

LATEST = 1.0
"""Seconds after the begin in which measurements from before it may still arrive."""


class Sensing:
    """Takes observations from the body and removes what cannot be used.

    Args:
        parts: of the loop.

    Attributes:
        health: of the body.
        image: the newest picture of the camera.
        depth_image: the newest picture of a depth camera.
    """

    def __init__(self, parts: LoopParts) -> None:
        self._parts = parts
        robot = parts.body.description
        self._deskewer, self._sensors = Deskewer(), SensorWatch(robot)
        self._frozen = FrozenScans(robot)
        self._own_body = OwnBody(robot)
        self._rates = SensorRates(robot)
        self.health: BodyHealth = HEALTHY
        self._begin: float | None = None
        self.image: Image | None = None
        self.depth_image: DepthImage | None = None

    def sense(self, pose: Pose2D) -> Observation:
        """Return the new measurements; report problems of the body.

        Args:
            pose: of the base after the last step, odom frame.
        """
        observation, health = self._parts.body.sense(), self._parts.body.health
        if health != self.health:
            self.health = health
            text = health.problem or "the robot works again"
            level = "error" if health.problem else "info"
            self._parts.telemetry.emit("body", text, source="body", level=level)
        self._record(observation)
        observation = self._since_begin(observation)
        observation, frozen = self._frozen.removed(observation, pose)
        self._report(frozen)
        self._rates.update(observation)
        observation = self._with_usable_pictures(observation, pose)
        self.image = next(iter(observation.of(Image).values()), self.image)
        depth = observation.of(DepthImage)
        self.depth_image = next(iter(depth.values()), self.depth_image)
        observation = self._with_calibrated_gyro(observation)
        return self._own_body.removed(self._parts.perceiver.depth_scans.added_to(observation))

    def _with_calibrated_gyro(self, observation: Observation) -> Observation:
        """Return the observation with yaw rates as calibrated; logs have them as measured."""
        described, measured = self._parts.body.description.imu, observation.imu
        if described is None or measured is None:
            return observation
        if described.gyro_scale == 1.0 and described.gyro_offset == 0.0:
            return observation
        corrected = described.corrected(measured)
        return Observation(observation.time, {**observation.measurements, "imu": corrected})

    def _since_begin(self, observation: Observation) -> Observation:
        """Return the observation without what was measured before the first one.

        A real robot's sensors run already then, and there is no pose for what they saw. Old stamps
        that come later are those of a wrong clock, which others count and report.
        """
        if self._begin is None:
            self._begin = observation.time
        begin = self._begin
        if observation.time - begin > LATEST:
            return observation
        if all(one.stamp >= begin for one in observation.measurements.values()):
            return observation
        kept = {name: one for name, one in observation.measurements.items() if one.stamp >= begin}
        return Observation(observation.time, kept)

    def sensors(self) -> tuple[SensorState, ...]:
        """How often each sensor delivers."""
        on = {camera.name for camera in self._parts.perceiver.cameras.states if camera.is_on}
        return self._rates.states(self._parts.body.time, on)

    @property
    def silence(self) -> dict[str, float]:
        """Seconds for which each silent lidar, sonar or IMU has delivered nothing."""
        return self._sensors.silence(self._parts.body.time)

    def _with_usable_pictures(self, observation: Observation, pose: Pose2D) -> Observation:
        """Return the observation without pictures that cannot be used; report faulty cameras."""
        perceiver, body = self._parts.perceiver, self._parts.body
        watch = perceiver.cameras
        requested = [COLOUR_CAMERA] if perceiver.captures(body.time) else []
        if perceiver.measures_depth(body.time):
            requested += body.description.depth_cameras
        usable, events = watch.update(observation, pose, requested)
        for event in events:
            self._parts.telemetry.emit(
                "camera", event.text, source="perception",
                level="warning" if event.fault else "info",
                camera=event.sensor, fault=event.fault,
            )  # fmt: skip
        return usable

    def deskewed(self, observation: Observation) -> Observation:
        """Return the observation with the scans that odometry covers; report silent sensors."""
        usable = self._deskewer.update(observation, self._parts.perceiver.frames)
        self._watch_sensors(usable)
        return usable

    @property
    def dropped_scans(self) -> dict[str, int]:
        """Number of scans by sensor that could not be used."""
        return dict(self._deskewer.dropped)

    def _watch_sensors(self, observation: Observation) -> None:
        """Report sensors that deliver nothing; after a recording none does."""
        body = self._parts.body
        if isinstance(body, Replay) and body.recording_over:
            return
        self._report(self._sensors.update(observation, self._deskewer.dropped))

    def _report(self, events: Sequence[SensorEvent]) -> None:
        for event in events:
            self._parts.telemetry.emit(
                "sensor", event.text, source="perception",
                level="warning" if event.fault else "info",
                sensor=event.sensor, fault=event.fault,
            )  # fmt: skip

    def _record(self, observation: Observation) -> None:
        """Append to the sensor log; a full disk ends the log, not the mission."""
        if self._parts.sensor_log is None:
            return
        try:
            self._parts.sensor_log.write(observation)
        except OSError as error:
            self._parts.sensor_log = None
            text = f"the sensor log ends here: {error.strerror}"
            self._parts.telemetry.emit("record", text, source="records", level="error")
            self._parts.telemetry.lose(SENSORS, reason_of(error))
