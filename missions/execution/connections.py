"""Links of a run: MAVLink, Foxglove, and the channel through which operators command it."""

from __future__ import annotations

from missions.execution.prepare import RunOptions
from stack.errors import InputError, TelemetryError
from stack.telemetry.hub import Telemetry
from stack.telemetry.rendezvous import choose_socket
from stack.telemetry.server import TelemetryServer
from stack.telemetry.sinks import Sink


def network_sinks_of(options: RunOptions) -> tuple[list[Sink], TelemetryServer | None]:
    """Return the sinks on the network, and the server that operators command the run through.

    Raises:
        InputError: an address is wrong, a port is in use, or there is no place for the socket of
            the server.
    """
    sinks: list[Sink] = []
    if options.mavlink:
        from stack.telemetry.mavlink.sink import MavlinkVehicle

        sinks.append(
            MavlinkVehicle(options.mavlink, key=options.mavlink_key, home_item=options.mavlink_home)
        )
    elif options.mavlink_key is not None:
        raise InputError("--mavlink-key signs the link of --mavlink, which is not given")
    if options.foxglove is not None:
        from stack.telemetry.foxglove.server import FoxgloveServer

        sinks.append(FoxgloveServer(options.foxglove))
    if not options.serve:
        return sinks, None
    try:
        choose_socket()
    except TelemetryError as error:
        raise _without_control(error) from None
    return sinks, TelemetryServer(folder=options.out)


def open_control(telemetry: Telemetry, server: TelemetryServer) -> None:
    """Announce the run.

    Raises:
        InputError: operators could not command it.
    """
    try:
        telemetry.attach(server, required=True)
    except TelemetryError as error:
        telemetry.close(None)
        raise _without_control(error) from None


def _without_control(error: TelemetryError) -> InputError:
    return InputError(f"the robot does not start, since nobody could command or stop it: {error}")
