"""Conversion between our frames and MAVLink's: the only place where signs and axes change.

Ours: world east-north-up (ENU), body forward-left-up (FLU). MAVLink's: world north-east-down (NED),
body forward-right-down (FRD). Each conversion is its own inverse; it has a name for both directions
so that the reader sees in which frame a value is. Plain floats and tuples: a process of the
fast loop can use it without NumPy.

The world is ENU only if the map's x axis points east; `stack.mavlink.origin` turns maps that are
not. LOCAL_FRD is an odom frame whose x axis points anywhere: it converts like a body frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, remainder

Vector = tuple[float, float, float]
"""x, y, z."""

Planar = tuple[float, float, float]
"""x and y, metres, and heading or yaw, radians; or their velocities."""

Matrix3 = tuple[Vector, Vector, Vector]

_WORLD = ((1, 0, 2), (1.0, 1.0, -1.0))
_BODY = ((0, 1, 2), (1.0, -1.0, -1.0))
"""Axes and signs: component i of the result is sign[i] * input[axis[i]]."""


def ned_from_enu(vector: Vector) -> Vector:
    """Convert a vector of the world from east-north-up to north-east-down."""
    x, y, z = vector
    return y, x, -z


def enu_from_ned(vector: Vector) -> Vector:
    """Convert a vector of the world from north-east-down to east-north-up."""
    return ned_from_enu(vector)


def frd_from_flu(vector: Vector) -> Vector:
    """Convert a vector of the body, or its turn rates, from left and up to right and down."""
    x, y, z = vector
    return x, -y, -z


def flu_from_frd(vector: Vector) -> Vector:
    """Convert a vector of the body, or its turn rates, from right and down to left and up."""
    return frd_from_flu(vector)


def ned_yaw(heading: float) -> float:
    """Yaw clockwise from north of a heading anticlockwise from east, in [-pi, pi]."""
    return remainder(0.5 * pi - heading, 2.0 * pi)


def enu_heading(yaw: float) -> float:
    """Heading anticlockwise from east of a yaw clockwise from north, in [-pi, pi]."""
    return ned_yaw(yaw)


def ned_pose(x: float, y: float, heading: float) -> Planar:
    """North, east and yaw of a pose in the world."""
    return y, x, ned_yaw(heading)


def frd_pose(x: float, y: float, heading: float) -> Planar:
    """X, y and yaw in LOCAL_FRD of a pose in an odom frame."""
    return x, -y, remainder(-heading, 2.0 * pi)


def frd_twist(linear: float, lateral: float, angular: float) -> Planar:
    """Velocity forward and to the right, yaw rate to the right, of a twist of the base."""
    return linear, -lateral, -angular


def flu_twist(forward: float, right: float, yaw_rate: float) -> Planar:
    """Velocity forward (linear) and to the left (lateral), turn to the left (angular)."""
    return frd_twist(forward, right, yaw_rate)


def ned_covariance(covariance: Sequence[Sequence[float]]) -> Matrix3:
    """Covariance (3, 3) of x, y, heading in ENU, or of a vector, as that of its NED equivalent."""
    return _transformed(covariance, _WORLD)


def frd_covariance(covariance: Sequence[Sequence[float]]) -> Matrix3:
    """Covariance (3, 3) of a twist or a pose in an odom frame as that in FRD."""
    return _transformed(covariance, _BODY)


def _transformed(
    covariance: Sequence[Sequence[float]],
    change: tuple[tuple[int, int, int], Vector],
) -> Matrix3:
    axis, sign = change

    def row(i: int) -> Vector:
        a, b, c = (sign[i] * sign[j] * float(covariance[axis[i]][axis[j]]) for j in range(3))
        return a, b, c

    return row(0), row(1), row(2)


_PLANAR_AXES = (0, 1, 5)
"""x, y and yaw among x, y, z, roll, pitch, yaw."""


def pack_covariance(planar: Sequence[Sequence[float]], unknown: float = 1e-3) -> list[float]:
    """Upper triangle (21) of the covariance of x, y, z, roll, pitch, yaw, as messages carry it.

    Args:
        planar: (3, 3) of x, y and yaw, or of their velocities.
        unknown: variance of z, roll and pitch, which a robot on a floor does not change.
    """
    packed = []
    for i in range(6):
        for j in range(i, 6):
            if i in _PLANAR_AXES and j in _PLANAR_AXES:
                packed.append(float(planar[_PLANAR_AXES.index(i)][_PLANAR_AXES.index(j)]))
            else:
                packed.append(unknown if i == j else 0.0)
    return packed
