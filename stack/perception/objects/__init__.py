"""Object detection: ONNX models, places of the objects they find, and people among the tracks."""
