"""Arm authorisation by MAVSDK's own server, which reads along on our line."""

from __future__ import annotations

import queue
from typing import TYPE_CHECKING, Any

from planner.errors import LinkError, UsageError
from planner.link.authorisation import ArmRequest
from planner.link.connection import OWN_COMPONENT

if TYPE_CHECKING:
    from planner.link.authorisation import ArmAnswer
    from planner.link.connection import Connection

_MISSING = "mavsdk is missing, which --authoriser mavsdk asks for: pip install 'mavjoule[link]'"


class MavsdkAuthoriser:
    """An `planner.link.guard_session.Authoriser`; to be closed.

    MAVSDK gets every byte that the line brings, and what it sends goes out through the line's gate:
    there is one line, one system id and one list of what may be sent.

    Parameters
    ----------
    connection : Connection
        With a vehicle on it.

    Raises
    ------
    UsageError
        If mavsdk is not installed.
    """

    def __init__(self, connection: Connection) -> None:
        try:
            import mavsdk
            from mavsdk.plugins import arm_authorizer_server as plugin
        except ImportError as error:
            raise UsageError(_MISSING) from error
        mavsdk.log_subscribe(lambda *_: True)  # it would talk to standard error
        self._connection = connection
        self._plugin: Any = plugin.arm_authorizer_server
        self._asked: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._number = 0
        configuration = mavsdk.Configuration.create_manual(
            connection.own_system,
            OWN_COMPONENT,
            False,  # noqa: FBT003 - MAVSDK's own; heartbeats are the connection's
        )
        self._mavsdk = mavsdk.Mavsdk(configuration)
        self._mavsdk.add_any_connection("raw://")
        self._mavsdk.subscribe_raw_bytes_to_be_sent(
            lambda frame: connection.send_frame(bytes(frame))
        )
        self._server = self._plugin.ArmAuthorizerServer(self._mavsdk.server_component(0))
        # MAVSDK wants its answers from another thread than its callback's.
        self._server.subscribe_arm_authorization(lambda system, _: self._asked.put(system))
        connection.on_frame = self._mavsdk.pass_received_raw_bytes

    def requests(self) -> tuple[ArmRequest, ...]:
        """Return the requests that came since the last call."""
        found: list[ArmRequest] = []
        vehicle = self._connection.vehicle
        while not self._asked.empty():
            self._asked.get()  # a system id that PX4 leaves 0
            self._number += 1
            found.append(
                ArmRequest(system=vehicle.system, component=vehicle.component, number=self._number)
            )
        return tuple(found)

    def answer(self, answer: ArmAnswer) -> None:
        """Answer a request.

        Raises
        ------
        LinkError
            If MAVSDK does not send it.
        """
        try:
            if answer.is_accepted:
                self._server.accept_arm_authorization(answer.valid_for_s)
            else:
                reason = self._plugin.RejectionReason(int(answer.reason))
                is_temporary = answer.result.value == 1
                self._server.reject_arm_authorization(is_temporary, reason, answer.extra_info)
        except self._plugin.ArmAuthorizerServerError as error:
            msg = f"MAVSDK could not send the answer to an arm request: {error}"
            raise LinkError(msg) from error

    def close(self) -> None:
        """Leave the line."""
        self._connection.on_frame = None
        self._server.destroy()
        self._mavsdk.destroy()
