"""How long a ground station has been silent, for the failsafe `operator`."""

from __future__ import annotations

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.vehicle import Vehicle


def test_heartbeats_of_stations_count_and_those_of_other_systems_do_not():
    class Link:
        def send(self, message):
            return True

    handover, now = Handover(), [10.0]
    vehicle = Vehicle(handover, Link(), lambda: now[0])
    sender = mav.MAVLink(None, 255, 190)
    for kind, heard in ((mav.MAV_TYPE_ONBOARD_CONTROLLER, None), (mav.MAV_TYPE_GCS, 10.0)):
        beat = sender.heartbeat_encode(kind, mav.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        beat.pack(sender)
        vehicle.take(beat)
        assert handover.heard == heard
