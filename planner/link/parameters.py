"""The parameter protocol: every parameter of a vehicle, whatever the line loses.

PARAM_REQUEST_LIST makes the vehicle send all of them; what is missing when it falls silent is asked
for by number with PARAM_REQUEST_READ.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.transfers import Transfer
from planner.link.wire import message
from planner.values import Value

if TYPE_CHECKING:
    from planner.link.transfers import LinkSettings
    from planner.link.wire import Message


MOST_PARAMETERS = 5_000
"""PX4 and ArduPilot have one to two thousand; a vehicle that claims more is not believed."""
_MOST_COUNTS = 6
"""Both autopilots hide and show parameters as others change; what continues to change is wrong."""
_AT_ONCE = 16
"""Parameters asked for together: few enough for the buffer of a radio."""
_NO_INDEX = 65_535
"""Of a parameter that was sent for another reason than its number."""
_LAYOUTS = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i", 9: "<f"}
"""By MAV_PARAM_TYPE, how four bytes hold a value."""


class WireParameter(Value):
    """One PARAM_VALUE."""

    name: str
    value: float
    """As the message's own float."""
    content: bytes
    """The four bytes of it."""
    kind: int
    """MAV_PARAM_TYPE."""

    def number(self, *, is_bytewise: bool) -> float:
        """Return the value.

        Bytewise, whole numbers are in the four bytes as they are, as PX4 sends them, and not as a float of
        the same value, as ArduPilot does.
        """
        layout = _LAYOUTS.get(self.kind)
        if not is_bytewise or layout is None:
            return self.value
        (number,) = struct.unpack_from(layout, self.content)
        return float(number)

    @property
    def is_whole(self) -> bool:
        """Whether its type holds whole numbers alone."""
        return self.kind < 9


PARAMETER_FILE = "@PARAM/param.pck"
"""What ArduPilot packs its parameters into when it is read (``AP_Filesystem_Param.cpp``)."""
STORAGE_FILE = "@SYS/storage.bin"
"""ArduPilot's storage for parameters and lists, as it is (``AP_Filesystem_Sys.cpp``)."""
PACKED_HEAD, PACKED_MAGIC = struct.Struct("<HHH"), 0x671B
"""Magic number, parameters in the file, parameters in all."""
PACKED_KINDS = {1: (2, "<b"), 2: (4, "<h"), 3: (6, "<i"), 4: (9, "<f")}
"""By ArduPilot's type, MAV_PARAM_TYPE and layout."""


def read_packed_parameters(data: bytes) -> tuple[WireParameter, ...]:
    """Return the parameters of a file that ArduPilot packs them into; `LinkError` where it is not whole."""
    found: list[WireParameter] = []
    try:
        magic, number, total = PACKED_HEAD.unpack_from(data)
        at, name = PACKED_HEAD.size, b""
        while at < len(data) and magic == PACKED_MAGIC:
            if not data[at]:  # a pad before a value that no packet is to cut
                at += 1
                continue
            kind, layout = PACKED_KINDS[data[at]]
            common, more = data[at + 1] & 15, (data[at + 1] >> 4) + 1
            name = name[:common] + data[at + 2 : at + 2 + more]
            at += 2 + more
            (value,) = struct.unpack_from(layout, data, at)
            at += struct.calcsize(layout)
            found.append(
                WireParameter(
                    name=name.decode("utf-8", errors="replace"),
                    value=float(value),
                    content=struct.pack("<f", value),  # as PARAM_VALUE has it
                    kind=kind,
                )
            )
    except (struct.error, KeyError, IndexError) as error:
        msg = f"{PARAMETER_FILE} is damaged after {len(found)} parameters"
        raise LinkError(msg) from error
    names = {one.name for one in found}
    if magic != PACKED_MAGIC or not len(names) == len(found) == number == total:
        msg = f"{PARAMETER_FILE} holds {len(names)} of {total} parameters"
        raise LinkError(msg)
    return tuple(found)


class ParameterDownload(Transfer):
    """Every parameter that a vehicle is asked for."""

    def __init__(self, settings: LinkSettings) -> None:
        super().__init__(settings)
        self._count: int | None = None
        self._counts = 0
        self._by_index: dict[int, WireParameter] = {}
        self._outstanding: set[int] = set()
        self._is_repeated = False

    @property
    def progress(self) -> tuple[int, int | None]:
        """Parameters so far, and how many there are."""
        return len(self._by_index), self._count

    @property
    def parameters(self) -> tuple[WireParameter, ...]:
        """All of them, in the vehicle's order, once it is done."""
        return tuple(self._by_index[index] for index in sorted(self._by_index))

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message; `LinkError` where the number of parameters cannot be believed."""
        if self.is_done or received.name != "PARAM_VALUE":
            return ()
        index, count = received["param_index"], received["param_count"]
        if index == _NO_INDEX or index >= count:
            return ()
        if count != self._count:
            self._begin_again(count)
        is_new = index not in self._by_index
        self._by_index[index] = WireParameter(
            name=received["param_id"],
            value=received["param_value"],
            content=received["param_bytes"],
            kind=received["param_type"],
        )
        if len(self._by_index) == self._count:
            return self._end(now_s)
        if not is_new:
            return ()
        was_asked = index in self._outstanding
        self._outstanding.discard(index)
        if was_asked and not self._outstanding:
            return self._go_on(now_s)
        if was_asked:  # the others of the same request are on their way
            self._timer.answered(now_s)
        self._timer.sent(now_s)
        return ()

    def _requests(self) -> tuple[Message, ...]:
        if self._count is None:
            return (message("PARAM_REQUEST_LIST"),)
        missing = [index for index in range(self._count) if index not in self._by_index]
        self._outstanding = set(missing[:_AT_ONCE])
        return tuple(
            message("PARAM_REQUEST_READ", param_id="", param_index=index)
            for index in missing[:_AT_ONCE]
        )

    def _end(self, now_s: float) -> tuple[Message, ...]:
        """End, or ask for all again, once, where one has come under two numbers."""
        assert self._count is not None  # every parameter has it
        names = {one.name for one in self._by_index.values()}
        if len(names) == self._count or self._is_repeated:
            self.is_done = True
            return ()
        self._is_repeated = True
        self._begin_again(self._count)
        self._timer.sent(now_s)
        return (message("PARAM_REQUEST_LIST"),)

    def _begin_again(self, count: int) -> None:
        """Forget what came: with one more or less, all later ones have other numbers."""
        self._counts += 1
        if count > MOST_PARAMETERS or self._counts > _MOST_COUNTS:
            changing = "" if self._count is None else f", after {self._count}"
            msg = (
                f"the vehicle claims {count} parameters{changing}: not plausible, or "
                "they change all the time; try again"
            )
            raise LinkError(msg)
        self._count = count
        self._by_index.clear()
        self._outstanding.clear()

    def _stalled(self, waited_s: float) -> str:
        if self._count is None:
            what = "none came"
        else:
            first = min(set(range(self._count)) - self._by_index.keys())
            what = f"number {first + 1} of {self._count} did not come"
        return (
            f"the parameters stalled: {what} in {self._timer.attempts} requests and "
            f"{waited_s:.0f} s; bring the radio closer, or give a longer "
            "--reply-timeout or more --retries"
        )
