"""`treepilot calibrate`: registers its commands."""

import typer

from missions.cli.calibrate.camera import camera
from missions.cli.calibrate.hand_eye import EPILOG as HAND_EYE_EPILOG
from missions.cli.calibrate.hand_eye import hand_eye
from missions.cli.calibrate.lidar import EPILOG as LIDAR_EPILOG
from missions.cli.calibrate.lidar import lidar
from missions.cli.calibrate.odometry import EPILOG as ODOMETRY_EPILOG
from missions.cli.calibrate.odometry import odometry

calibrate_app = typer.Typer(
    no_args_is_help=True, help="Calibrate cameras, their mounts, the odometry or lidars."
)
calibrate_app.command()(camera)
calibrate_app.command("hand-eye", epilog=HAND_EYE_EPILOG)(hand_eye)
calibrate_app.command(epilog=ODOMETRY_EPILOG)(odometry)
calibrate_app.command(epilog=LIDAR_EPILOG)(lidar)
