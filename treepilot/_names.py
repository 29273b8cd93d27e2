"""The names of `treepilot`, imported together when the first one is used.

`import X as X` exports a name for type checkers too.
"""

from py_trees.common import Status as Status

import behaviours.base as _behaviours
import stack.costmap.layer as _costmap
from behaviours.base import DRIVE_FAILURES as DRIVE_FAILURES
from behaviours.base import output as output
from behaviours.base import port as port
from behaviours.timer import Timer as Timer
from missions import run as run
from missions import run_together as run_together
from missions.execution.client import connect as connect
from missions.execution.client import connect_async as connect_async
from missions.execution.client.asynchronous import AsyncConnection as AsyncConnection
from missions.execution.client.connection import Connection as Connection
from missions.execution.client.conversation import CommandRefused as CommandRefused
from missions.execution.report import Report as Report
from robots.bodies import BodyKind as BodyKind
from robots.bodies import BodySetup as BodySetup
from stack.body import Body as Body
from stack.body import BodyCommand as BodyCommand
from stack.body import BodyHealth as BodyHealth
from stack.components import DEFAULT_PLAN_OPTIONS as DEFAULT_PLAN_OPTIONS
from stack.components import CancelToken as CancelToken
from stack.components import Controller as Controller
from stack.components import ControlState as ControlState
from stack.components import DriveState as DriveState
from stack.components import Estimator as Estimator
from stack.components import GoalChecker as GoalChecker
from stack.components import GoalTolerance as GoalTolerance
from stack.components import Match as Match
from stack.components import OdometryFusion as OdometryFusion
from stack.components import PathSegment as PathSegment
from stack.components import Planner as Planner
from stack.components import PlanOptions as PlanOptions
from stack.components import ProgressChecker as ProgressChecker
from stack.components import StopCriterion as StopCriterion
from stack.components import TransformBuffer as TransformBuffer
from stack.costmap.layer import NO_BOX as NO_BOX
from stack.costmap.layer import Box as Box
from stack.costmap.layer import Canvas as Canvas
from stack.costmap.layer import LayerUpdate as LayerUpdate
from stack.costmap.layer import Posed as Posed
from stack.costmap.layer import Region as Region
from stack.drivetrain.description import RobotDescription as RobotDescription
from stack.errors import BodyError as BodyError
from stack.errors import InputError as InputError
from stack.errors import NavigationError as NavigationError
from stack.errors import ParameterError as ParameterError
from stack.errors import TelemetryError as TelemetryError
from stack.errors import TreepilotError as TreepilotError
from stack.fast_loop.driver import Lack as Lack
from stack.lifecycle import Timers as Timers
from stack.parameters import parameter as parameter
from stack.robot import Arm as Arm
from stack.robot import Base as Base
from stack.robot import Gripper as Gripper
from stack.robot import Localisation as Localisation
from stack.robot import Map as Map
from stack.robot import Perception as Perception
from stack.robot import Robot as Robot
from stack.robot import Task as Task
from stack.streams import stream as stream
from stack.telemetry.records import Event as Event
from stack.telemetry.records import MissionState as MissionState
from stack.telemetry.records import RunInfo as RunInfo
from stack.telemetry.records import Snapshot as Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording as SnapshotRecording
from stack.types import FREE as FREE
from stack.types import FREE_COST as FREE_COST
from stack.types import INSCRIBED_COST as INSCRIBED_COST
from stack.types import LETHAL_COST as LETHAL_COST
from stack.types import OCCUPIED as OCCUPIED
from stack.types import STANDSTILL as STANDSTILL
from stack.types import UNKNOWN as UNKNOWN
from stack.types import UNKNOWN_COST as UNKNOWN_COST
from stack.types import Assignments as Assignments
from stack.types import Battery as Battery
from stack.types import Block as Block
from stack.types import ContactZone as ContactZone
from stack.types import CostGrid as CostGrid
from stack.types import CoveragePlan as CoveragePlan
from stack.types import DepthImage as DepthImage
from stack.types import Detection as Detection
from stack.types import Expression as Expression
from stack.types import Failure as Failure
from stack.types import FailureCode as FailureCode
from stack.types import FloatArray as FloatArray
from stack.types import FloorLines as FloorLines
from stack.types import Footprint as Footprint
from stack.types import Frontier as Frontier
from stack.types import GripperCommand as GripperCommand
from stack.types import GripperState as GripperState
from stack.types import Image as Image
from stack.types import Imu as Imu
from stack.types import JointState as JointState
from stack.types import JointTrajectory as JointTrajectory
from stack.types import Marker as Marker
from stack.types import MarkerFix as MarkerFix
from stack.types import MarkerObservation as MarkerObservation
from stack.types import MarkerSighting as MarkerSighting
from stack.types import Observation as Observation
from stack.types import OccupancyGrid as OccupancyGrid
from stack.types import Odometry as Odometry
from stack.types import Path as Path
from stack.types import PlaceSighting as PlaceSighting
from stack.types import PointCloud as PointCloud
from stack.types import Pose2D as Pose2D
from stack.types import PoseEstimate as PoseEstimate
from stack.types import RangeReading as RangeReading
from stack.types import RivalPose as RivalPose
from stack.types import Scan as Scan
from stack.types import StandingObject as StandingObject
from stack.types import TaskStatus as TaskStatus
from stack.types import TrackedObject as TrackedObject
from stack.types import Twist as Twist
from stack.types import View as View
from stack.types import wrap_angle as wrap_angle

Behaviour = _behaviours.RobotBehaviour
CostmapLayer = _costmap.Layer
CostmapFrame = _costmap.Frame
