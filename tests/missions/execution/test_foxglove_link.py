"""A run that Foxglove watches is the same run."""

import socket

from websockets.sync.client import connect

from missions.execution.prepare import RunOptions, diagnose
from missions.execution.running import execute
from stack.telemetry.sinks import Sink

MISSION = "mission: m\nrobot: scout\nworld: small_room\nstart: dock\nrun: {wait: 1 s}\n"


class Spectator(Sink):
    """Connects to the run's server, which began before it, and reads what the server says."""

    def __init__(self, port):
        self._port, self.said = port, ""

    def wants_snapshot(self, time):
        if not self.said:
            address = f"ws://127.0.0.1:{self._port}"
            with connect(address, subprotocols=["foxglove.sdk.v1"]) as client:
                self.said = client.recv(timeout=10)
        return False


def test_the_event_log_is_the_same_with_and_without(tmp_path):
    (tmp_path / "m.yaml").write_text(MISSION)
    plan = diagnose(tmp_path / "m.yaml").plan
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    spectator = Spectator(port)
    alone = execute(plan, RunOptions(serve=False))
    watched = execute(plan, RunOptions(serve=False, foxglove=port), [spectator])
    assert watched.log_sha256 == alone.log_sha256 and watched.status == "success"
    assert '"op":"serverInfo"' in spectator.said
