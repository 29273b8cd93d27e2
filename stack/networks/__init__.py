"""Networks from ONNX files, run by OpenCV: their headers, and their trial in another process."""
