"""Who is on the line, by heartbeats: which vehicle is spoken to, and whether it is one only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Hashable

    from planner.link.codec import Message

_NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID: cameras, gimbals, ground stations."""
_GROUND_STATION = 6
"""MAV_TYPE_GCS."""
_AUTOPILOT_COMPONENT = 1
_MOST_HEARD = 64
"""Vehicles remembered; a swarm's are named one by one."""


class Heard(Value):
    """One autopilot that sent a heartbeat."""

    system: int
    component: int
    autopilot: int
    vehicle_type: int


class HeartbeatWatch:
    """Every autopilot heard, and signs that two of them share a number.

    Parameters
    ----------
    system : int, optional
        The only system id to listen to.
    """

    def __init__(self, system: int | None = None) -> None:
        self._system = system
        self._heard: dict[tuple[int, int], Heard] = {}
        self._peers: dict[tuple[int, int], list[Hashable]] = {}
        self._uids: dict[int, str] = {}
        self._left: set[tuple[int, int, Hashable]] = set()
        self.others: set[int] = set()
        """System ids of vehicles that are not the one to listen to."""
        self.last_heard_s: float | None = None
        """When the latest heartbeat of any of them came. [s]"""

    @property
    def systems(self) -> tuple[int, ...]:
        """The system ids heard, in their order."""
        return tuple(sorted({system for system, _ in self._heard}))

    def take(self, received: Message, peer: Hashable, now_s: float) -> None:
        """Take a message of any kind.

        Raises
        ------
        LinkError
            If two vehicles answer to one system id: nothing that comes of them can be trusted.
        """
        if self._system is not None and received.system != self._system:
            if _is_vehicle(received) and len(self.others) < _MOST_HEARD:
                self.others.add(received.system)
            return
        if received.name == "HEARTBEAT":
            self._take_heartbeat(received, peer, now_s)
        elif received.name == "AUTOPILOT_VERSION":
            uid = uid_text(received)
            known = self._uids.setdefault(received.system, uid)
            if uid and known and uid != known:
                self._refuse(received.system, f"autopilots {known} and {uid} answer")
            self._uids[received.system] = known or uid

    def chosen(self) -> Heard | None:
        """Return the vehicle to speak to; ``None`` where none was heard.

        Raises
        ------
        LinkError
            If there are several.
        """
        if len(self.systems) > 1:
            ids = ", ".join(map(str, self.systems))
            msg = f"several vehicles are on the line (system ids {ids}): say which by --system-id"
            raise LinkError(msg)
        if not self._heard:
            return None
        return min(
            self._heard.values(), key=lambda h: (h.component != _AUTOPILOT_COMPONENT, h.component)
        )

    def _take_heartbeat(self, received: Message, peer: Hashable, now_s: float) -> None:
        autopilot, vehicle_type = received["autopilot"], received["type"]
        if not _is_vehicle(received):
            return
        self.last_heard_s = now_s
        key = (received.system, received.component)
        one = Heard(
            system=received.system,
            component=received.component,
            autopilot=autopilot,
            vehicle_type=vehicle_type,
        )
        if key not in self._heard and len(self._heard) >= _MOST_HEARD:
            return
        known = self._heard.setdefault(key, one)
        if known != one:
            self._refuse(
                received.system,
                f"MAV_AUTOPILOT {known.autopilot} of MAV_TYPE {known.vehicle_type} and "
                f"MAV_AUTOPILOT {autopilot} of MAV_TYPE {vehicle_type} answer",
            )
        for other in self._heard.values():
            if other.system == one.system and other.component != one.component:
                self._refuse(
                    one.system,
                    f"autopilots are heard as component {other.component} and {one.component}",
                )
        # A vehicle may come back from another port; two that are heard in turn are two.
        peers = self._peers.setdefault(key, [])
        if peers and peers[-1] != peer:
            if (*key, peer) in self._left:
                self._refuse(received.system, f"heartbeats come from {peers[-1]} and {peer}")
            self._left.add((*key, peers[-1]))
        peers[:] = [peer]

    def _refuse(self, system: int, why: str) -> None:
        msg = (
            f"two vehicles answer to system id {system}: {why}; give each an id of its own "
            "(MAV_SYS_ID, SYSID_THISMAV), or leave one of them off the line"
        )
        raise LinkError(msg)


def _is_vehicle(received: Message) -> bool:
    """Return whether a message is the heartbeat of an autopilot."""
    return (
        received.name == "HEARTBEAT"
        and received.system != 0
        and received["autopilot"] != _NO_AUTOPILOT
        and received["type"] != _GROUND_STATION
    )


def uid_text(version: Message) -> str:
    """Return the autopilot's own number of an AUTOPILOT_VERSION; empty where it sends none."""
    uid2 = bytes(version.fields.get("uid2") or ())
    if any(uid2):
        return uid2.hex().rstrip("0")
    return f"{version['uid']:x}" if version["uid"] else ""
