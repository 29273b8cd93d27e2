"""Third-party packages that some parts need and that an installation may lack: one table.

What needs one of them names it here and asks before anything moves. `check` and the commands then
say what is missing and how it is installed.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

from stack.errors import InputError

MISSING_PACKAGE = "E450"
"""Code of a finding about what this installation lacks."""

MISSING_DEVICE = "W450"
"""Code of a finding about hardware that is not there: a check of a mission needs none."""


@dataclass(frozen=True, slots=True)
class Package:
    """A package that is imported only where it is needed.

    Attributes:
        module: its name in `import`.
        requirement: what pip installs; an extra of treepilot, where there is one.
    """

    module: str
    requirement: str

    @property
    def is_installed(self) -> bool:
        """Whether it can be imported, as far as is known without importing it."""
        return find_spec(self.module) is not None

    @property
    def hint(self) -> str:
        """The command that installs it."""
        return f"install it: pip install '{self.requirement}'"

    @property
    def absence(self) -> str:
        """End of a sentence: `ROS bags need …`."""
        return f"the Python package {self.module}, which is not installed"

    def require(self, needs: str) -> None:
        """Refuse to go on without the package.

        Args:
            needs: begin of the sentence: `ROS bags need`.

        Raises:
            InputError: it is not installed.
        """
        if not self.is_installed:
            raise InputError(f"{needs} {self.absence}; {self.hint}")


GTSAM = Package("gtsam", "gtsam>=4.3,<5")
"""Pose graphs. A dependency of treepilot: it is missing only where it has no wheel."""

FOXGLOVE = Package("foxglove", "treepilot[foxglove]")
DISTRIBUTED = Package("distributed", "treepilot[cluster]")
GYMNASIUM = Package("gymnasium", "treepilot[gym]")
MODERNGL = Package("moderngl", "treepilot[gl]")
OPTUNA = Package("optuna", "treepilot[tune]")
PINOCCHIO = Package("pinocchio", "treepilot[arm]")
PYGLS = Package("pygls", "treepilot[lsp]")
PYSERIAL = Package("serial", "treepilot[serial]")
PYTHON_CAN = Package("can", "treepilot[can]")
ROSBAGS = Package("rosbags", "treepilot[logs]")
SCIPY = Package("scipy", "treepilot[sweep]")
CMA = Package("cma", "treepilot[falsify]")
