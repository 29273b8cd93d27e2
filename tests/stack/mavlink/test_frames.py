"""Conversions against rotation matrices: the same physical direction in both conventions."""

from math import pi

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stack.mavlink import frames

# Columns: where east, north, up point in NED; where forward, left, up point in FRD.
NED_OF_ENU = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
FRD_OF_FLU = np.diag([1, -1, -1.0])

number = st.floats(-1e3, 1e3)
vector = st.tuples(number, number, number)
angle = st.floats(-pi, pi)
entries = st.lists(st.floats(-3, 3), min_size=9, max_size=9)


@given(vector)
def test_vectors(v):
    assert np.array_equal(frames.ned_from_enu(v), NED_OF_ENU @ v)
    assert np.array_equal(frames.frd_from_flu(v), FRD_OF_FLU @ v)
    assert frames.enu_from_ned(frames.ned_from_enu(v)) == v
    assert frames.flu_from_frd(frames.frd_from_flu(v)) == v


@given(number, number, angle, st.floats(-2, 2), st.floats(-2, 2))
def test_a_velocity_of_the_base_is_the_same_in_the_world(x, y, heading, linear, lateral):
    north, east, yaw = frames.ned_pose(x, y, heading)
    assert (north, east) == (y, x)
    forward, right, _ = frames.frd_twist(linear, lateral, 0.0)
    c, s = np.cos(yaw), np.sin(yaw)
    velocity_ned = (c * forward - s * right, s * forward + c * right, 0.0)
    c, s = np.cos(heading), np.sin(heading)
    velocity_enu = (c * linear - s * lateral, s * linear + c * lateral, 0.0)
    assert np.allclose(frames.enu_from_ned(velocity_ned), velocity_enu, atol=1e-12)


def test_by_hand():
    assert frames.ned_pose(3.0, 7.0, pi / 2) == (7.0, 3.0, 0.0)  # facing north
    assert frames.ned_yaw(pi) == -pi / 2  # facing west
    assert frames.frd_twist(1.0, 0.5, 0.25) == (1.0, -0.5, -0.25)  # turning left
    assert frames.frd_pose(1.0, 2.0, 0.5) == (1.0, -2.0, -0.5)


@given(entries)
def test_covariances_rotate_as_their_values_do(values):
    root = np.array(values).reshape(3, 3)
    covariance = root @ root.T
    # The Jacobian of (north, east, yaw) by (x, y, heading) has the signs of NED_OF_ENU.
    world = np.array(frames.ned_covariance(covariance))
    assert np.allclose(world, NED_OF_ENU @ covariance @ NED_OF_ENU.T)
    body = np.array(frames.frd_covariance(covariance))
    assert np.allclose(body, FRD_OF_FLU @ covariance @ FRD_OF_FLU.T)


@given(entries)
def test_packed_covariances(values):
    root = np.array(values).reshape(3, 3)
    covariance = root @ root.T
    packed = frames.pack_covariance(covariance, unknown=0.5)
    assert len(packed) == 21
    full = np.zeros((6, 6))
    full[np.triu_indices(6)] = packed
    assert np.array_equal(full[np.ix_([0, 1, 5], [0, 1, 5])], np.triu(covariance))
    assert (full[2, 2], full[3, 3], full[4, 4]) == (0.5, 0.5, 0.5)
