"""Tiny ONNX models: one that always says the same, and one that finds a red thing."""

import numpy as np
from onnx import TensorProto, helper, numpy_helper, save

OPSET = [helper.make_opsetid("", 13)]


def save_constant(file, output, *, size=(64, 64), metadata=None, inputs=1):
    """Save a model whose output is the same for every picture.

    Args:
        file: to write.
        output: (1, a, b) the output.
        size: height and width of the input; None leaves them open.
        metadata: names and texts.
        inputs: number of inputs.
    """
    nodes = [
        # The mean of the picture times 0: a model without a path from its input is refused.
        helper.make_node("ReduceMean", ["images"], ["mean"], axes=[1, 2, 3], keepdims=0),
        helper.make_node("Mul", ["mean", "zero"], ["nothing"]),
        helper.make_node("Add", ["nothing", "result"], ["output0"]),
    ]
    stored = {"zero": np.zeros(1, np.float32), "result": np.asarray(output, np.float32)}
    return _saved(file, nodes, stored, size, np.shape(output), metadata or {}, inputs)


def save_red_finder(file, *, label="red box", size=(192, 256)):
    """Save a model that finds one red thing: a YOLOv8 head with a single candidate and class.

    A pixel is red by r - g - b > 0.15; the box is the smallest one around all red pixels.
    """
    height, width = size
    big = 1e4
    stored = {
        "weights": np.array([1.0, -1.0, -1.0], np.float32).reshape(1, 3, 1, 1),
        "least": np.array(0.15, np.float32), "steep": np.array(1e3, np.float32),
        "zero": np.array(0.0, np.float32), "one": np.array(1.0, np.float32),
        "x": np.arange(width, dtype=np.float32).reshape(1, 1, 1, width),
        "y": np.arange(height, dtype=np.float32).reshape(1, 1, height, 1),
        "big": np.array(big, np.float32), "half": np.array(0.5, np.float32),
        "form": np.array([1, 1, 1], np.int64),
    }  # fmt: skip
    nodes = [
        helper.make_node("Conv", ["images", "weights"], ["redness"], kernel_shape=[1, 1]),
        helper.make_node("Sub", ["redness", "least"], ["excess"]),
        helper.make_node("Mul", ["excess", "steep"], ["sharp"]),
        helper.make_node("Clip", ["sharp", "zero", "one"], ["mask"]),
        helper.make_node("Sub", ["one", "mask"], ["other"]),
        helper.make_node("Mul", ["other", "big"], ["far"]),
        helper.make_node("ReduceMax", ["mask"], ["score"], axes=[1, 2, 3], keepdims=1),
        helper.make_node("Reshape", ["score", "form"], ["score3"]),
    ]
    for axis in ("x", "y"):
        nodes += [
            helper.make_node("Add", ["far", axis], [f"{axis}_up"]),
            helper.make_node("ReduceMin", [f"{axis}_up"], [f"{axis}_low"], axes=[1, 2, 3]),
            helper.make_node("Sub", [axis, "far"], [f"{axis}_down"]),
            helper.make_node("ReduceMax", [f"{axis}_down"], [f"{axis}_last"], axes=[1, 2, 3]),
            helper.make_node("Add", [f"{axis}_last", "one"], [f"{axis}_high"]),
            helper.make_node("Add", [f"{axis}_low", f"{axis}_high"], [f"{axis}_sum"]),
            helper.make_node("Mul", [f"{axis}_sum", "half"], [f"{axis}_middle"]),
            helper.make_node("Sub", [f"{axis}_high", f"{axis}_low"], [f"{axis}_size"]),
            helper.make_node("Reshape", [f"{axis}_middle", "form"], [f"{axis}_middle3"]),
            helper.make_node("Reshape", [f"{axis}_size", "form"], [f"{axis}_size3"]),
        ]
    parts = ["x_middle3", "y_middle3", "x_size3", "y_size3", "score3"]
    nodes.append(helper.make_node("Concat", parts, ["output0"], axis=1))
    return _saved(file, nodes, stored, size, (1, 5, 1), {"names": str({0: label})}, 1)


def save_colour_descriptor(file, *, size=(48, 64), cells=16, pooled=True):
    """Save a model that describes a picture by the colours of its parts, each `cells` pixels wide.

    Args:
        file: to write.
        size: height and width of the input; None leaves them open.
        cells: side of a part in pixels.
        pooled: whether the output is one vector; else it is a picture of 3 channels.
    """
    nodes = [
        helper.make_node("AveragePool", ["images"], ["means"], kernel_shape=[cells, cells],
                         strides=[cells, cells]),
        helper.make_node("Flatten", ["means"], ["output0"], axis=1),
    ]  # fmt: skip
    if not pooled:
        nodes = nodes[:1]
        nodes[0].output[0] = "output0"
    height, width = (side // cells for side in size or (64, 64))
    shape = (1, 3 * height * width) if pooled else (1, 3, height, width)
    return _saved(file, nodes, {}, size, shape, {}, 1)


def _saved(file, nodes, stored, size, shape, metadata, inputs):
    sides = list(size) if size is not None else ["height", "width"]
    pictures = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 3, *sides])
        for name in ["images", "others"][:inputs]
    ]
    result = helper.make_tensor_value_info("output0", TensorProto.FLOAT, list(shape))
    weights = [numpy_helper.from_array(value, name) for name, value in stored.items()]
    graph = helper.make_graph(nodes, "tiny", pictures, [result], weights)
    model = helper.make_model(graph, opset_imports=OPSET, ir_version=8)
    for key, value in metadata.items():
        entry = model.metadata_props.add()
        entry.key, entry.value = key, value
    save(model, str(file))
    return file
