"""The fast loop: a process of its own that holds the hardware, at 50 to 1000 Hz.

It stops the robot when the brain, the process with the mission, is killed or frozen. Both share a
mailbox in memory (`mailbox`) and a socket for encoded messages; neither ever waits for the other.
The wheel loop is that of the simulation (stack/drivetrain/kernels.py); hardware is a `Driver`.
"""
