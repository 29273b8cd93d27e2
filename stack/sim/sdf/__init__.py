"""Gazebo worlds (SDFormat) as simulated worlds."""
