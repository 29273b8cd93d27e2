"""Matching of scans to the last keyframe: point-to-line alignment and a search around it."""
