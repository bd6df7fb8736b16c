"""Every spelling of an address means one thing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import UsageError
from planner.link.address import is_address, read_address

# Spellings: pymavlink's mavutil, MAVSDK 4's add_any_connection, MAVProxy's --master, MAVROS' fcu_url.
SPELLINGS = {
    "udpin:0.0.0.0:14550": "udpin:0.0.0.0:14550",
    "udp:127.0.0.1:14550": "udpin:127.0.0.1:14550",
    "udpin://0.0.0.0:14540": "udpin:0.0.0.0:14540",
    "udp://:14540": "udpin:0.0.0.0:14540",
    "127.0.0.1:14550": "udpin:127.0.0.1:14550",
    "localhost:14550": "udpin:localhost:14550",
    "udpout:127.0.0.1:14550": "udpout:127.0.0.1:14550",
    "udpout://127.0.0.1:14550": "udpout:127.0.0.1:14550",
    "tcp:127.0.0.1:5760": "tcp:127.0.0.1:5760",
    "tcp://127.0.0.1:5760": "tcp:127.0.0.1:5760",
    "tcpout://sitl.local:5760": "tcp:sitl.local:5760",
    "tcpin:0.0.0.0:5760": "tcpin:0.0.0.0:5760",
    "tcp-l://:5760": "tcpin:0.0.0.0:5760",
    "udpin:[::1]:14550": "udpin:[::1]:14550",
    "udp://:14540@127.0.0.1:14557": "udpin:0.0.0.0:14540@127.0.0.1:14557",
    "/dev/ttyUSB0": "serial:/dev/ttyUSB0:57600",
    "/dev/ttyUSB0,115200": "serial:/dev/ttyUSB0:115200",
    "/dev/ttyACM0:921600": "serial:/dev/ttyACM0:921600",
    "serial:///dev/ttyUSB0:57600": "serial:/dev/ttyUSB0:57600",
    "serial:/dev/ttyUSB0:57600": "serial:/dev/ttyUSB0:57600",
    "serial_flowcontrol:///dev/ttyACM0:57600": "serial_flowcontrol:/dev/ttyACM0:57600",
    "COM3": "serial:COM3:57600",
    "serial://COM3:115200": "serial:COM3:115200",
}


@pytest.mark.parametrize(("spelling", "text"), SPELLINGS.items())
def test_a_spelling_has_one_normalised_form(spelling: str, text: str) -> None:
    address = read_address(spelling)
    assert address.text == text
    assert read_address(address.text) == address
    assert is_address(spelling)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("udp:127.0.0.1", "it names no port|no port from"),
        ("udpin:0.0.0.0:70000", "not a port from 1 to 65535"),
        ("udpin:0.0.0.0:0", "not a port from 1 to 65535"),
        ("udpout:0.0.0.0:14550", "nothing can be sent to 0.0.0.0"),
        ("udpout::14550", "names no host"),
        ("tcp:a b:5760", "'a b' is not a host"),
        ("serial:ttyUSB0", "names no serial device"),
        ("/dev/ttyUSB0:7", "no serial line has 7 Bd"),
        ("udpin:14860", "it names a port and no interface, write 0.0.0.0:14860"),
        ("14550", "a port alone is ambiguous: udpin:0.0.0.0:14550 to listen on it"),
        ("/dev/ttyS0:abc", "'abc' is not a speed of /dev/ttyS0: write /dev/ttyS0:57600"),
        ("COM3,fast", "'fast' is not a speed of COM3: write COM3:57600"),
        ("http://localhost:80", "begins with none of udp, udpin"),
        ("site.plan", "begins with none of udp, udpin"),
        ("", "begins with none of udp, udpin"),
    ],
)
def test_what_is_no_address_is_refused_in_one_sentence(text: str, why: str) -> None:
    with pytest.raises(UsageError, match=why) as caught:
        read_address(text)
    assert "\n" not in str(caught.value)
    assert "such as udpin:0.0.0.0:14550" in str(caught.value)


def test_a_given_speed_holds_where_the_address_names_none() -> None:
    assert read_address("/dev/ttyUSB0", baud=115_200).baud == 115_200
    assert read_address("/dev/ttyUSB0:9600", baud=115_200).baud == 9600


@pytest.mark.parametrize("name", ["site.plan", "-", "C:\\a.plan", "a:b", "missions/x.txt", "x:80"])
def test_names_of_files_are_no_addresses(name: str) -> None:
    assert not is_address(name)


@given(st.text(max_size=40))
def test_any_text_is_an_address_or_refused(text: str) -> None:
    try:
        address = read_address(text)
    except UsageError:
        return
    assert read_address(address.text) == address
