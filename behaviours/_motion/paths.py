"""Parts of paths."""

from __future__ import annotations

from math import atan2

import numpy as np

from stack.types import Path


def shortened(path: Path, by: float, top_speed: float | None = None) -> Path | None:
    """Return a path without its last metres, facing its former end; None if nothing is left.

    Args:
        path: map frame.
        by: metres along the path.
        top_speed: speed limit of what is left, m/s; None: as it is.
    """
    points = path.points
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(along[-1]) - by
    if length <= 0.0:
        return None
    count = int(np.searchsorted(along, length, side="left"))
    share = (length - along[count - 1]) / max(float(along[count] - along[count - 1]), 1e-9)
    end = points[count - 1] + share * (points[count] - points[count - 1])
    end[2] = atan2(points[-1, 1] - end[1], points[-1, 0] - end[0])
    kept = np.concatenate([points[:count], [end]])
    limits = path.speed_limits
    limits = np.full(len(kept), np.inf) if limits is None else limits[: count + 1].copy()
    if top_speed is not None:
        limits = np.minimum(limits, top_speed)
    return Path(kept, limits if np.isfinite(limits).any() else None, path.partial)
