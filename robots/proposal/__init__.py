"""Proposes a robot.yaml for a URDF: drive, outline and sensors from its links and joints."""
