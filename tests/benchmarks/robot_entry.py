"""A run of one robot with one seed, of the benches that compare robots."""

from __future__ import annotations

from dataclasses import dataclass

from missions.bench.bench import Key, Options, robot_label


@dataclass(frozen=True)
class RobotEntry:
    """A run of one robot with one seed.

    Attributes:
        robot: name or file.
        seed: of all that is drawn, and of the run.
        options: of the bench.
    """

    robot: str
    seed: int
    options: Options

    @property
    def key(self) -> Key:
        """Unique key in the table."""
        return robot_label(self.robot), self.seed

    @property
    def label(self) -> str:
        """Name of the settings that it shares with others."""
        return robot_label(self.robot)
