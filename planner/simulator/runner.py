"""A simulated vehicle on a real line: UDP or TCP, in the foreground or in a thread."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from planner.link.address import LinkKind
from planner.link.line import open_line, opening_error
from planner.simulator.lines import TcpServerLine

if TYPE_CHECKING:
    from types import TracebackType

    from planner.link.address import LinkAddress
    from planner.link.line import Line
    from planner.simulator.lines import SimulatedWire
    from planner.simulator.servers import FileServer


_LONGEST_WAIT_S = 0.1
"""Until it is seen that somebody wants it to stop. [s]"""
_FILES_WAIT_S = 0.003
"""Files are served by a thread of MAVSDK's: it is asked this often while it may answer. [s]"""


class SimulationRunner:
    """Keeps a simulated vehicle speaking on a line.

    Parameters
    ----------
    wire : SimulatedWire
        The vehicle, and what goes wrong.
    address : LinkAddress
        The vehicle's end of the line.
    file_server : FileServer, optional
        The one that the wire has; closed with this.

    Raises
    ------
    LinkError
        If the line cannot be opened.
    """

    def __init__(
        self,
        wire: SimulatedWire,
        address: LinkAddress,
        *,
        file_server: FileServer | None = None,
    ) -> None:
        self._wire = wire
        self._file_server = file_server
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        try:
            self._line = _open(address)
        except BaseException:
            if file_server is not None:
                file_server.close()
            raise

    def __enter__(self) -> SimulationRunner:
        """Speak in a thread."""
        self._thread = threading.Thread(target=self.run, name="simulated vehicle", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop, and close the line."""
        self.close()

    def now_s(self) -> float:
        """Return the time by the clock of the line [s]."""
        return self._line.now_s()

    def run(self) -> None:
        """Speak until `close` is called, or the program is interrupted.

        Raises
        ------
        LinkError
            If the line breaks, other than by ground stations that come and go.
        """
        while not self._stop.is_set():
            self._turn()

    def close(self) -> None:
        """Stop speaking and close the line; once is enough."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._line.close()
        if self._file_server is not None:
            self._file_server.close()
            self._file_server = None

    def _turn(self) -> None:
        now_s = self._line.now_s()
        for frame in self._wire.due(now_s):
            self._line.send(frame)
        is_serving = self._file_server is not None and self._file_server.is_busy
        longest_s = _FILES_WAIT_S if is_serving else _LONGEST_WAIT_S
        wait_s = min(max(self._wire.deadline_s - now_s, 0.0), longest_s)
        for peer, data in self._line.receive(wait_s):
            self._wire.receive(data, self._line.now_s(), peer)


def _open(address: LinkAddress) -> Line:
    """Return the open line of a vehicle."""
    if address.kind is not LinkKind.TCP_LISTEN:
        return open_line(address)
    try:
        return TcpServerLine(address)
    except OSError as error:
        raise opening_error(address, error) from error
