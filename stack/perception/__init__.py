"""Fiducial markers in images, and tracking of moving objects in scans."""
