"""Public interface for drivers of motors, which run in the fast loop's process.

It imports no more than that process needs: `import treepilot` loads nothing by itself, and a name
of `treepilot` loads the packages of a mission.
"""

from stack.drivetrain.wheel_loop import DRIVING as DRIVING
from stack.drivetrain.wheel_loop import OFF as OFF
from stack.drivetrain.wheel_loop import STOPPING as STOPPING
from stack.errors import BodyError as BodyError
from stack.fast_loop.driver import Driver as Driver
from stack.fast_loop.driver import DriverCommand as DriverCommand
from stack.fast_loop.driver import DriverFeedback as DriverFeedback
from stack.fast_loop.driver import DriverSetup as DriverSetup
from stack.fast_loop.driver import Lack as Lack
from stack.parameters import parameter as parameter
