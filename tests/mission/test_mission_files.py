from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import os
import socket
import tempfile
import zipfile
from pathlib import Path

import pytest

from planner.errors import MissionFileError
from planner.mission.files import read_mission, read_mission_bytes
from planner.mission.formats import exchange
from planner.mission.items import Mission, MissionFormat

WPL = (
    "QGC WPL 110\n"
    "0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\n"
)
PLAN = json.dumps(
    {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "x",
        "geoFence": {"version": 2, "circles": [], "polygons": []},
        "rallyPoints": {"version": 2, "points": []},
        "mission": {
            "version": 2,
            "firmwareType": 12,
            "vehicleType": 2,
            "plannedHomePosition": [47.1, 8.5, 488],
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "items": [
                {
                    "type": "SimpleItem",
                    "command": 22,
                    "frame": 3,
                    "params": [0, 0, 0, None, 47.1, 8.5, 20],
                    "autoContinue": True,
                    "doJumpId": 1,
                }
            ],
        },
    }
)


def make_zip(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return stream.getvalue()


def read(data: bytes | str, source: str = "mission") -> Mission:
    return read_mission_bytes(data.encode() if isinstance(data, str) else data, source=source)


def codes(mission: Mission) -> list[str]:
    return [finding.code for finding in mission.findings]


def refusal(data: bytes | str) -> str:
    with pytest.raises(MissionFileError) as caught:
        read(data)
    assert str(caught.value).startswith("mission:")
    return caught.value.message


def test_a_file_is_what_its_content_says() -> None:
    assert read(WPL).file_format is MissionFormat.WPL
    assert read(PLAN).file_format is MissionFormat.PLAN
    assert [item.command for item in read(WPL).items] == [22]
    assert [item.command for item in read(PLAN).items] == [22]


@pytest.mark.parametrize(
    ("content", "name", "expected"),
    [
        (WPL, "a.plan", ["L161"]),
        (WPL, "a.json", ["L161"]),
        (PLAN, "a.waypoints", ["L161"]),
        (PLAN, "a.TXT", ["L161"]),
        (WPL, "a.waypoints", []),
        (WPL, "a.txt", []),
        (WPL, "a", []),
        (WPL, "-", []),
        (PLAN, "a.plan", []),
        (PLAN, "a.b.mission", []),
    ],
)
def test_a_suffix_of_another_format_is_told_and_changes_nothing(
    content: str, name: str, expected: list[str]
) -> None:
    mission = read(content, name)
    assert codes(mission) == expected
    assert len(mission.items) == 1


@pytest.mark.parametrize("codec", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("content", [WPL, PLAN])
def test_other_encodings_are_read_and_told(content: str, codec: str) -> None:
    mission = read(content.encode(codec))
    assert len(mission.items) == 1
    assert codes(mission) == ["L162"]


def test_latin_1_comments_are_read_and_told() -> None:
    mission = read((WPL + "# Übung\n").encode("latin-1"))
    assert "L162" in codes(mission)
    assert len(mission.items) == 1


@pytest.mark.parametrize("content", [WPL, PLAN])
def test_a_gzip_file_is_read_and_told(content: str) -> None:
    mission = read(gzip.compress(content.encode()))
    assert len(mission.items) == 1
    assert codes(mission) == ["L163"]


def test_a_zip_archive_that_holds_one_mission_is_read_and_told() -> None:
    data = make_zip({"notes.txt": b"hello", "a/survey.plan": PLAN.encode()})
    mission = read(data, "all.zip")
    assert len(mission.items) == 1
    assert "'a/survey.plan'" in mission.findings[0].message
    assert codes(mission) == ["L163"]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (make_zip({"a.txt": b"x"}), "no mission"),
        (make_zip({"a.plan": b"{}", "b.plan": b"{}"}), "2 missions"),
        (make_zip({"doc.kml": b"<kml/>"}), "Google Earth"),
        (make_zip({"a.plan": PLAN.encode()})[:-30], "broken"),
        (b"PK\x03\x04 and nothing", "broken"),
        (gzip.compress(WPL.encode(), mtime=0)[:-10], "broken"),
        (b"\x1f\x8bnonsense", "broken"),
        (gzip.compress(gzip.compress(WPL.encode(), mtime=0), mtime=0), "twice"),
        (gzip.compress(make_zip({"a.plan": PLAN.encode()}), mtime=0), "in another"),
        (bz2.compress(WPL.encode()), "bzip2"),
        (lzma.compress(WPL.encode()), "xz"),
    ],
    # not their bytes, which hold the time of day: every worker collects the same names
    ids=["none", "two", "kmz", "cut", "head", "cut-gzip", "odd", "twice", "nested", "bz2", "xz"],
)
def test_archives_that_give_no_mission_are_refused(data: bytes, message: str) -> None:
    assert message in refusal(data)


def test_an_encrypted_archive_is_refused() -> None:
    data = bytearray(make_zip({"a.plan": PLAN.encode()}))
    # Bit 0 of the flags, at offset 6 of the local and 8 of the central header: encrypted.
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    assert "encrypted" in refusal(bytes(data))


@pytest.mark.parametrize("pack", [gzip.compress, lambda data: make_zip({"a.plan": data})])
def test_a_compressed_bomb_is_refused_before_it_is_unpacked(
    pack: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exchange, "LARGEST_FILE_BYTES", 2**20)
    assert callable(pack)
    assert "MiB" in refusal(pack(b" " * 2**22))


def test_a_file_larger_than_any_mission_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exchange, "LARGEST_FILE_BYTES", 2**20)
    path = tmp_path / "large.plan"
    path.write_bytes(b" " * (2**20 + 1))
    with pytest.raises(MissionFileError, match="more than 1 MiB"):
        read_mission(path)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("", "empty"),
        (" \n\t\n", "empty"),
        ("\ufeff", "empty"),
        ("hello there\n", "begins with 'hello there'"),
        ("import sys\nprint(1)\n", "Python"),
        ("#!/usr/bin/env python\nx = 1\n", "Python"),
        ("QGC WPL PB 110\nwaypoint {\n}\n", "protobuf"),
        ("WPNAV_SPEED,1000\nRTL_ALT,1500\nLAND_SPEED,50\n", "--params"),
        ("# note\n1\t1\tMPC_XY_CRUISE\t5.0\t9\n1\t1\tMPC_ACC_HOR\t3\t9\n" * 2, "--params"),
        ('<?xml version="1.0"?>\n<!-- by wp -->\n<MISSION><VERSION/></MISSION>', "MultiWii"),
        ("<mission></mission>", "iNav"),
        ('<?xml version="1.0"?><kml xmlns="x"></kml>', "Google Earth"),
        ("<!DOCTYPE html><html></html>", "web page"),
        ("<gpx:gpx></gpx:gpx>", "GPX"),
        ("<svg></svg>", "XML (<svg>)"),
        ("[1, 2]", "JSON"),
        ('{"type": "FeatureCollection"}', "JSON"),
        ('{"workout": 1}', "'workout'"),
        (b"ULog\x01\x12\x35\x01" + bytes(40), "PX4 flight log"),
        (b"\xa3\x95\x80\x80" + bytes(40), "ArduPilot flight log"),
        (b"\0\5\xb1\x11\x22\x33\x44\x55\xfd\x09" + bytes(40), "telemetry log"),
        (b"%PDF-1.7\n", "PDF"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "picture"),
        (bytes(range(256)), "binary"),
        (b"\xff\xfe\0\0", "binary"),
    ],
)
def test_what_is_no_mission_is_named_with_what_to_do(data: bytes | str, message: str) -> None:
    assert message in refusal(data)


def test_a_fence_list_and_a_rally_list_are_read() -> None:
    assert read("47 8\n47 8.1\n47.1 8.1\n47.1 8\n47 8.1\n").fence
    assert len(read("RALLY 47 8 60 40 0 0\n").rally) == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [("missing.plan", "no such file"), ("nul\0.plan", "cannot be read"), ("x" * 5000, "long")],
)
def test_a_path_that_leads_nowhere_is_refused(tmp_path: Path, name: str, message: str) -> None:
    with pytest.raises(MissionFileError, match=message):
        read_mission(tmp_path / name)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MissionFileError, match="folder"):
        read_mission(tmp_path)


def test_a_pipe_from_another_program_is_read() -> None:
    # As a shell's <(command) hands it over.
    outlet, inlet = os.pipe()
    with os.fdopen(outlet), os.fdopen(inlet, "wb") as writer:
        writer.write(WPL.encode())
        writer.close()
        assert len(read_mission(f"/dev/fd/{outlet}").items) == 1


def test_a_pipe_that_nobody_writes_to_is_empty_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(MissionFileError, match="empty"):
        read_mission(tmp_path / "pipe")


def test_a_device_is_refused() -> None:
    with pytest.raises(MissionFileError, match="device"):
        read_mission("/dev/zero")


def test_a_socket_is_refused() -> None:
    # A socket's path must be short, which pytest's own folders are not everywhere.
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as endpoint:
        path = Path(folder) / "s"
        endpoint.bind(str(path))
        with pytest.raises(MissionFileError, match="device"):
            read_mission(path)


def test_a_file_without_permission_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.plan"
    path.write_text(PLAN)

    def deny(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    # The tests may run as root, whom no file mode stops.
    monkeypatch.setattr(Path, "open", deny)
    with pytest.raises(MissionFileError, match="no permission"):
        read_mission(path)


def test_a_file_is_read_from_a_path_or_its_text(tmp_path: Path) -> None:
    path = tmp_path / "a.waypoints"
    path.write_text(WPL)
    assert read_mission(path) == read_mission(str(path))
    assert read_mission(path).source == str(path)


def test_a_dash_is_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(WPL.encode())))
    mission = read_mission("-")
    assert mission.source == "-"
    assert len(mission.items) == 1
