"""MAVFTP by MAVSDK's own server, which is given the messages and asked for the answers.

MAVSDK's other server plugins are not used.  Its mission server takes a mission but cannot be given
one, and knows neither fence, rally points nor ArduPilot's home slot; its parameter server sets what
it is sent; its telemetry server sends at no one's request.  None of them has a clock but its own.
"""

from __future__ import annotations

import queue
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.link.codec import Codec

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.link.message import Message
    from planner.link.simulated.setup import VehicleLog

_NAME = "FILE_TRANSFER_PROTOCOL"
_PEERS = frozenset({_NAME, "HEARTBEAT"})
_BUSY_S = 2.0


class FileServer:
    """The files of a vehicle.

    Parameters
    ----------
    system, component : int
        Whose they are.
    logs : sequence of VehicleLog
        Written to a folder of their own, which goes when this is closed.

    Raises
    ------
    UsageError
        If MAVSDK is not installed.
    """

    def __init__(self, system: int, component: int, logs: Sequence[VehicleLog]) -> None:
        try:
            import mavsdk
            from mavsdk.plugins.ftp_server import FtpServer
        except ImportError as error:
            msg = (
                "MAVSDK 4 is missing, which serves the files of a simulated vehicle: install it with "
                "pip install 'mavjoule[link]'"
            )
            raise UsageError(msg) from error

        self._folder = tempfile.TemporaryDirectory(prefix="mavjoule-")
        root = Path(self._folder.name)
        for log in logs:
            path = root / log.path.lstrip("/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(log.content)
        self._said: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._codecs: dict[tuple[int, int], Codec] = {}
        self._decoder = Codec(0, 0)
        self._busy_until_s = 0.0
        mavsdk.log_subscribe(_swallow)
        self._mavsdk: Any = mavsdk.Mavsdk(
            mavsdk.Configuration.create_manual(system, component, always_send_heartbeats=False)
        )
        self._mavsdk.add_any_connection("raw://")
        self._handle = self._mavsdk.subscribe_raw_bytes_to_be_sent(self._said.put)
        self._server: Any = FtpServer(self._mavsdk.server_component(0))
        self._server.set_root_dir(str(root))

    @property
    def is_busy(self) -> bool:
        """Whether an answer may still come."""
        return time.monotonic() < self._busy_until_s

    def take(self, received: Message) -> None:
        """Take a message of a ground station, of any kind."""
        if received.name not in _PEERS:
            return
        sender = received.system, received.component
        if sender not in self._codecs:
            self._codecs[sender] = Codec(*sender)
        if received.name == _NAME:
            self._busy_until_s = time.monotonic() + _BUSY_S
        self._mavsdk.pass_received_raw_bytes(self._codecs[sender].encode(received))

    def answers(self) -> tuple[Message, ...]:
        """Return what it has to say about files; its heartbeats are the vehicle's matter."""
        found: list[Message] = []
        while not self._said.empty():
            found += self._decoder.decode(self._said.get())
        return tuple(one for one in found if one.name == _NAME)

    def close(self) -> None:
        """Stop serving and remove the folder."""
        self._server.destroy()
        self._mavsdk.unsubscribe_raw_bytes_to_be_sent(self._handle)
        self._mavsdk.destroy()
        self._folder.cleanup()


def _swallow(*_: object) -> bool:
    """Keep MAVSDK from writing to standard error."""
    return True
