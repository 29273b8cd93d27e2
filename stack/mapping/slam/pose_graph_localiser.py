"""The estimator `pose_graph`: localisation in a map that SLAM has saved."""

from __future__ import annotations

from pathlib import Path

from stack.errors import InputError
from stack.mapping.slam.estimator import SlamEstimator


class PoseGraphLocaliser(SlamEstimator):
    """Localisation in a saved pose graph: scan matching with the nearest keyframes.

    The map stays as it is until the mission uses `set_mapping`. An unknown start is searched for on
    the whole map.
    """

    needs_map = True
    starts_mapping = False

    @classmethod
    def check_map(cls, folder: Path | None) -> None:
        """Check that the map is a saved one with a pose graph."""
        if folder is None:
            raise InputError(
                "the estimator 'pose_graph' needs a map that was saved with `localisation: slam`;"
                " give its folder, or use `localisation: mcl`"
            )
        super().check_map(folder)
