"""Missions as environments of Gymnasium, for learning; needs `treepilot[gym]`.

    import gymnasium
    import treepilot.gym

    env = gymnasium.make("treepilot/Mission-v0", mission="01_drive_to_a_point")

The import makes the environment known to Gymnasium. `gymnasium.make` can also import it by itself,
in a process of its own too: "treepilot.gym:treepilot/Mission-v0".
"""

from stack.optional_packages import GYMNASIUM

GYMNASIUM.require("treepilot.gym needs")

from gymnasium.envs.registration import register as _register  # noqa: E402
from gymnasium.envs.registration import registry as _registry  # noqa: E402

from missions.learning.environment import MissionEnv as MissionEnv  # noqa: E402

ENVIRONMENT = "treepilot/Mission-v0"
"""Name of the environment for `gymnasium.make`."""

if ENVIRONMENT not in _registry:
    _register(ENVIRONMENT, entry_point="treepilot.gym:MissionEnv")
