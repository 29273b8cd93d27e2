"""Data types of treepilot. Metres, radians, seconds; x forward, y left, z up.

Frames follow REP 105: map -> odom -> base -> sensors. Every record is frozen; its arrays must not
be modified after it was passed on.
"""

from stack.types.camera import CameraModel, CameraState
from stack.types.detections import (
    NO_OBJECTS,
    OBJECT_COLOURS,
    PERSON,
    ColourMask,
    Detection,
    ObjectColour,
    SeenObjects,
)
from stack.types.distortion import DISTORTION
from stack.types.disturbances import (
    Disturbance,
    DroppedBox,
    LiftedRobot,
    MovedDoor,
    PushedRobot,
    SetCharge,
    SilencedSensor,
)
from stack.types.docks import ContactZone, DockShape
from stack.types.exploration import CoveragePlan, Frontier
from stack.types.expressions import (
    Assignments,
    Expression,
)
from stack.types.floor_lines import LINE_COLOURS, FloorLines, LineColour
from stack.types.geometry import (
    STANDSTILL,
    FloatArray,
    Footprint,
    Path,
    Pose2D,
    Twist,
    wrap_angle,
)
from stack.types.grids import (
    FREE,
    FREE_COST,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    CostGrid,
    OccupancyGrid,
)
from stack.types.limitations import Limitation
from stack.types.obstacles import NO_DEPTH, DepthPoints, ObstaclePoints, RangeView, SeenGround
from stack.types.parameter_info import ParameterInfo, ParameterTable
from stack.types.perceived import NOTHING_MOVES, CurrentStep, Perceived, WorldView, has_jumped
from stack.types.places import PlaceSighting
from stack.types.sensor_state import SensorState
from stack.types.sensors import (
    NO_COVARIANCE,
    Battery,
    DepthImage,
    Image,
    Imu,
    Measurement,
    Observation,
    Odometry,
    PointCloud,
    RangeReading,
    Scan,
)
from stack.types.tasks import (
    Failure,
    FailureCode,
    TaskStatus,
)
from stack.types.world import (
    MARKER_DICTIONARIES,
    TRACK_PADDING,
    HealthThresholds,
    Marker,
    MarkerFix,
    MarkerObservation,
    MarkerSighting,
    PoseCandidate,
    PoseEstimate,
    RelativePose,
    RivalPose,
    StandingObject,
    TrackedObject,
    View,
)

__all__ = [
    "Disturbance",
    "DroppedBox",
    "LiftedRobot",
    "MovedDoor",
    "PushedRobot",
    "SetCharge",
    "SilencedSensor",
    "NOTHING_MOVES",
    "CurrentStep",
    "Perceived",
    "WorldView",
    "NO_OBJECTS",
    "OBJECT_COLOURS",
    "PERSON",
    "TRACK_PADDING",
    "ColourMask",
    "Detection",
    "ObjectColour",
    "SeenObjects",
    "ContactZone",
    "DockShape",
    "LINE_COLOURS",
    "FloorLines",
    "Limitation",
    "LineColour",
    "Assignments",
    "Battery",
    "DepthImage",
    "DepthPoints",
    "NO_DEPTH",
    "CameraModel",
    "CameraState",
    "DISTORTION",
    "CostGrid",
    "CoveragePlan",
    "Expression",
    "FREE",
    "FREE_COST",
    "Failure",
    "FailureCode",
    "FloatArray",
    "Footprint",
    "Frontier",
    "INSCRIBED_COST",
    "Image",
    "Imu",
    "LETHAL_COST",
    "MARKER_DICTIONARIES",
    "Marker",
    "MarkerFix",
    "MarkerObservation",
    "MarkerSighting",
    "Measurement",
    "NO_COVARIANCE",
    "OCCUPIED",
    "Observation",
    "ObstaclePoints",
    "OccupancyGrid",
    "ParameterInfo",
    "ParameterTable",
    "Odometry",
    "PointCloud",
    "Path",
    "PlaceSighting",
    "Pose2D",
    "HealthThresholds",
    "PoseCandidate",
    "PoseEstimate",
    "RelativePose",
    "RangeReading",
    "RangeView",
    "RivalPose",
    "STANDSTILL",
    "Scan",
    "SensorState",
    "SeenGround",
    "StandingObject",
    "TaskStatus",
    "TrackedObject",
    "Twist",
    "View",
    "UNKNOWN",
    "UNKNOWN_COST",
    "has_jumped",
    "wrap_angle",
]
