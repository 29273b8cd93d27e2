"""Import of Gazebo worlds (SDFormat)."""
