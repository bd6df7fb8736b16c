"""Whole messages with anything in their fields, often what is almost right."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hypothesis import strategies as st

from planner.link.wire import LAYOUTS, Codec, Message, load_dialect

if TYPE_CHECKING:
    from collections.abc import Sequence

_FEW = st.sampled_from([0, 1, 2, 3, 5, 16, 22, 255])
_FLOATS = st.one_of(st.sampled_from([0.0, 1.0, 33.0, 512.0]), st.floats(width=32))
_TEXTS = st.sampled_from(["MPC_XY_CRUISE", "", "RTL_ALT", "_HASH_CHECK", "Mission rejected", "A"])
_OPERATIONS = st.sampled_from([128, 129, 128, 0, 255])
_FORMATS = {"I": "uint32_t", "H": "uint16_t", "B": "uint8_t"}


@st.composite
def hostile_frames(
    draw: st.DrawFn,
    names: Sequence[str],
    *,
    sender: tuple[int, int],
    targets: Sequence[int] = (0, 1, 1, 1, 9),
) -> bytes:
    """Draw a frame of one of some messages.

    Parameters
    ----------
    names : sequence of str
        Of the messages.
    sender : tuple of int
        System and component.
    targets : sequence of int
        Systems and components that it may be for.
    """
    name = draw(st.sampled_from(names))
    fields: dict[str, Any] = {}
    for field, type_name, length in _definition(name):
        if type_name == "char":
            fields[field] = draw(_TEXTS)
            continue
        is_float = type_name in {"float", "double"}
        value = draw(_FLOATS if is_float else _whole(type_name))
        fields[field] = [value] * length if length else value
    for target in ("target_system", "target_component"):
        if target in fields:
            fields[target] = draw(st.sampled_from(targets))
    if name == "FILE_TRANSFER_PROTOCOL":
        fields["payload"] = _answer(draw)
    if name in LAYOUTS and "arguments" in fields:
        fields["arguments"] = bytes(fields["arguments"])
    return Codec(*sender).encode(Message(name=name, fields=fields))


def _definition(name: str) -> list[tuple[str, str, int]]:
    """Return name, type and length of each field, 0 of what is no array."""
    if name in LAYOUTS:
        return [
            (field, _FORMATS.get(form, "uint8_t"), int(form[:-1] or 0))
            for field, form in LAYOUTS[name].fields
        ]
    kind = getattr(load_dialect(), f"MAVLink_{name.lower()}_message")
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    types = zip(kind.fieldnames, kind.fieldtypes, strict=True)
    return [(field, type_name, lengths[field]) for field, type_name in types]


def _whole(type_name: str) -> st.SearchStrategy[int]:
    bits = int(type_name.removesuffix("_t").lstrip("uint"))
    if type_name[0] == "u":
        return st.one_of(_FEW.filter(lambda n: n < 2**bits), st.integers(0, 2**bits - 1))
    half = 2 ** (bits - 1)
    return st.one_of(_FEW.filter(lambda n: n < half), st.integers(-half, half - 1))


def _answer(draw: st.DrawFn) -> list[int]:
    """Return a payload that begins as one of the file protocol does."""
    head = [draw(_FEW), draw(_FEW), draw(_FEW), draw(_OPERATIONS), draw(_FEW), draw(_FEW)]
    rest = draw(st.binary(min_size=6, max_size=60))
    return [*head, *rest, *bytes(251 - 6 - len(rest))]
