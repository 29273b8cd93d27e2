"""Body that drives a rover over MAVLink: ArduRover in GUIDED, PX4 in OFFBOARD."""
