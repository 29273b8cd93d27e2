"""Policies as ONNX files, and a mission that they drive."""

from __future__ import annotations

import numpy as np
from onnx import TensorProto, helper, numpy_helper, save

MISSION = """\
mission: drive by a policy
robot: scout
world: small_room
navigation:
  controller: {{use: onnx_policy, file: policy.onnx, observations: [{names}]{more}}}
  goal_checker: {{use: simple_goal, position: 25 cm, heading: 180 deg}}
run:
  navigate_to_pose: {{goal: {goal}}}
  timeout: 40 s
"""

FOLLOWER = ("path", "remaining")
"""Observations of `follower`."""


def save_affine(file, weights, offsets, sizes, *, least=None, most=None):
    """Save a policy that is an affine map: one input for each name in `sizes`, and clipped.

    Args:
        file: to write.
        weights: (actions, all numbers of the inputs).
        offsets: (actions,).
        sizes: name of an input -> its shape without the batch.
        least: (actions,) smallest values.
        most: (actions,) largest values.
    """
    actions = len(offsets)
    stored = {
        "weights": np.asarray(weights, np.float32).T,
        "offsets": np.asarray(offsets, np.float32)[None],
        "least": np.asarray([least if least is not None else [-9.0] * actions], np.float32),
        "most": np.asarray([most if most is not None else [9.0] * actions], np.float32),
    }
    nodes = [helper.make_node("Flatten", [name], [f"{name}_flat"], axis=1) for name in sizes]
    nodes += [
        helper.make_node("Concat", [f"{name}_flat" for name in sizes], ["all"], axis=1),
        helper.make_node("MatMul", ["all", "weights"], ["product"]),
        helper.make_node("Add", ["product", "offsets"], ["sum"]),
        helper.make_node("Max", ["sum", "least"], ["above"]),
        helper.make_node("Min", ["above", "most"], ["action"]),
    ]
    inputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, *shape])
        for name, shape in sizes.items()
    ]
    output = helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, actions])
    kept = [numpy_helper.from_array(array, name) for name, array in stored.items()]
    graph = helper.make_graph(nodes, "policy", inputs, [output], kept)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    model.ir_version = 8
    save(model, str(file))
    return file


def follower():
    """Weights and offsets that steer to the second point of the path and slow down at its end.

    By pure pursuit, the turn to a point at (L, y) is 2 v y / L²: 1.6 y for L = 0.8 m at 0.5 m/s.
    """
    weights = np.zeros((2, 11), np.float32)
    weights[0, 10], weights[1, 3] = 0.5, 1.6
    return weights, np.array([0.1, 0.0], np.float32)
