"""Data types of treepilot. Metres, radians, seconds; x forward, y left, z up.

Frames follow REP 105: map -> odom -> base -> sensors. Every record is frozen; its arrays must not
be modified after it was passed on.
"""

from stack.types.detections import OBJECT_COLOURS, Detection, ObjectColour
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
from stack.types.obstacles import NO_DEPTH, DepthPoints, ObstaclePoints, RangeView, SeenGround
from stack.types.places import PlaceSighting
from stack.types.sensors import (
    NO_COVARIANCE,
    Battery,
    CameraModel,
    DepthImage,
    Image,
    Imu,
    Measurement,
    Observation,
    Odometry,
    RangeReading,
    Scan,
)
from stack.types.tasks import (
    Failure,
    FailureCode,
    TaskStatus,
)
from stack.types.world import (
    HealthThresholds,
    Marker,
    MarkerSighting,
    PoseCandidate,
    PoseEstimate,
    RivalPose,
    TrackedObject,
    View,
)

__all__ = [
    "OBJECT_COLOURS",
    "Detection",
    "ObjectColour",
    "ContactZone",
    "DockShape",
    "LINE_COLOURS",
    "FloorLines",
    "LineColour",
    "Assignments",
    "Battery",
    "DepthImage",
    "DepthPoints",
    "NO_DEPTH",
    "CameraModel",
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
    "Marker",
    "MarkerSighting",
    "Measurement",
    "NO_COVARIANCE",
    "OCCUPIED",
    "Observation",
    "ObstaclePoints",
    "OccupancyGrid",
    "Odometry",
    "Path",
    "PlaceSighting",
    "Pose2D",
    "HealthThresholds",
    "PoseCandidate",
    "PoseEstimate",
    "RangeReading",
    "RangeView",
    "RivalPose",
    "STANDSTILL",
    "Scan",
    "SeenGround",
    "TaskStatus",
    "TrackedObject",
    "Twist",
    "View",
    "UNKNOWN",
    "UNKNOWN_COST",
    "wrap_angle",
]
