from __future__ import annotations

import pytest

from planner.errors import MissionFileError
from planner.findings import Place, Severity
from planner.mission.formats.wpl import read_wpl
from planner.mission.items import Home, Mission, MissionFormat, VehicleKind

HOME = "0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1"
TAKEOFF = "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1"
WAYPOINT = "2\t0\t3\t16\t5\t0\t0\t0\t47.2\t8.6\t30\t1"
RTL = "3\t0\t0\t20\t0\t0\t0\t0\t0\t0\t0\t1"


def read(*lines: str, header: str = "QGC WPL 110", end: str = "\n") -> Mission:
    return read_wpl(end.join([header, *lines]) + end, source="m.waypoints")


def codes(mission: Mission) -> list[str]:
    return [finding.code for finding in mission.findings]


def test_a_tidy_file_gives_its_items_its_home_and_no_findings() -> None:
    mission = read(HOME, TAKEOFF, WAYPOINT, RTL)
    assert [item.command for item in mission.items] == [22, 16, 20]
    assert mission.home == Home(latitude_deg=47.1, longitude_deg=8.5, altitude_amsl_m=488.0)
    assert mission.findings == ()
    assert mission.file_format is MissionFormat.WPL
    assert mission.source == "m.waypoints"


def test_a_row_fills_the_fields_in_the_order_of_the_format() -> None:
    row = "1\t0\t10\t31\t1\t2\t3\t4\t-5.5\t-6.25\t7.75\t0"
    (item,) = read(HOME, row).items
    assert (item.frame, item.command, item.autocontinue) == (10, 31, False)
    assert (item.param1, item.param2, item.param3, item.param4) == (1.0, 2.0, 3.0, 4.0)
    assert (item.latitude_deg, item.longitude_deg, item.altitude_m) == (-5.5, -6.25, 7.75)


def test_an_item_knows_its_line_and_the_column_its_row_begins_in() -> None:
    mission = read(HOME, "# up", "   " + TAKEOFF)
    assert mission.items[0].place == Place(4, 4)


def test_a_jump_goes_by_the_row_number_in_which_home_counts_as_0() -> None:
    assert [item.jump_id for item in read(HOME, TAKEOFF, WAYPOINT).items] == [1, 2]


def test_a_version_120_file_has_no_home_row_and_numbers_its_rows_from_0() -> None:
    rows = TAKEOFF.replace("1\t0", "0\t0", 1), WAYPOINT.replace("2\t0", "1\t0", 1)
    mission = read(*rows, header="QGC WPL 120")
    assert mission.home is None
    assert [item.jump_id for item in mission.items] == [0, 1]
    assert codes(mission) == ["L150"]


@pytest.mark.parametrize(
    "rows",
    [
        [row.replace("\t", " ") for row in (HOME, TAKEOFF, WAYPOINT, RTL)],
        [row.replace("\t", "  \t") for row in (HOME, TAKEOFF, WAYPOINT, RTL)],
        [row.replace("\t", ",") for row in (HOME, TAKEOFF, WAYPOINT, RTL)],
        [HOME, TAKEOFF, "", WAYPOINT, "# home again", RTL],
        [HOME, TAKEOFF, WAYPOINT + "  # over the barn", RTL],
        [HOME, TAKEOFF, WAYPOINT.replace("\t0\t0\t0\t", "\t0   0   0\t", 1), RTL],
    ],
    ids=["spaces", "spaces and tabs", "commas", "blank and comment", "comment behind", "one mixed"],
)
def test_other_dialects_give_the_same_items(rows: list[str]) -> None:
    plain = read(HOME, TAKEOFF, WAYPOINT, RTL)
    mission = read(*rows)
    assert [(i.command, i.latitude_deg, i.altitude_m) for i in mission.items] == [
        (i.command, i.latitude_deg, i.altitude_m) for i in plain.items
    ]
    assert mission.home == plain.home


@pytest.mark.parametrize(
    "rows", [[HOME.replace("\t", " ")], [HOME, ""], [HOME, "# a comment"], [HOME + " # home"]]
)
def test_what_qgroundcontrol_refuses_is_told_once(rows: list[str]) -> None:
    mission = read(*rows)
    assert codes(mission) == ["L151"]
    assert "QGroundControl refuses" in mission.findings[0].message


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n"])
def test_lines_may_end_in_any_way(end: str) -> None:
    mission = read(HOME, TAKEOFF, WAYPOINT, end=end)
    assert [item.place for item in mission.items] == [Place(3, 1), Place(4, 1)]
    assert mission.findings == ()


def test_the_last_line_needs_no_line_end() -> None:
    mission = read_wpl(f"QGC WPL 110\n{HOME}\n{TAKEOFF}", source="m")
    assert len(mission.items) == 1


def test_a_header_without_rows_is_an_empty_mission() -> None:
    mission = read_wpl("QGC WPL 110", source="m")
    assert mission.items == ()
    assert mission.home is None


@pytest.mark.parametrize(
    "header", ["QGC WPL 110 ", "QGC WP L110", "QGC\tWPL\t110", "qgc wpl 110", "# mine\nQGC WPL 110"]
)
def test_odd_headers_are_read_and_told(header: str) -> None:
    mission = read(HOME, TAKEOFF, header=header)
    assert len(mission.items) == 1
    assert codes(mission) == ["L150"]


def test_a_file_without_a_header_is_read_and_told() -> None:
    mission = read_wpl(f"{HOME}\n{TAKEOFF}\n", source="m")
    assert mission.home is not None
    assert [item.place for item in mission.items] == [Place(2, 1)]
    assert codes(mission) == ["L150"]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("QGC WPL PB 110", "protobuf"),
        ("QGC WPL 100", "other columns"),
        ("QGC WPL 130", "version is '130'"),
        ("QGC WPL", "version is ''"),
    ],
)
def test_other_versions_are_refused_with_what_to_do(header: str, message: str) -> None:
    with pytest.raises(MissionFileError, match=message) as caught:
        read(HOME, header=header)
    assert caught.value.place == Place(1, 1)


@pytest.mark.parametrize("token", ["nan", "NaN", "Nan", "-nan", "null", "None"])
def test_words_for_no_value_are_none_and_told(token: str) -> None:
    row = f"1\t0\t3\t16\t0\t0\t0\t{token}\t47\t8\t{token}\t1"
    mission = read(HOME, row)
    assert mission.items[0].param4 is None
    assert mission.items[0].altitude_m is None
    assert codes(mission) == ["L154"]


def test_zero_stays_zero() -> None:
    (item,) = read(HOME, TAKEOFF).items
    assert (item.param4, item.latitude_deg, item.longitude_deg) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "first",
    [
        "0\t1\t3\t22\t15\t0\t0\t0\t47.1\t8.5\t20\t1",
        "0\t0\t3\t84\t0\t0\t0\t0\t47.1\t8.5\t20\t1",
        "0\t0\t2\t178\t1\t5\t0\t0\t0\t0\t0\t1",
        "1\t0\t3\t179\t1\t0\t0\t0\t0\t0\t0\t1",
        "1\t0\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t500\t1",
        "0\t0\t3\t16\t0\t0\t0\t0\t47.1\t8.5\t50\t1",
    ],
    ids=[
        "take-off",
        "VTOL take-off",
        "speed",
        "set home",
        "waypoint numbered 1",
        "waypoint 50 m up",
    ],
)
def test_a_first_row_that_is_not_home_is_flown_and_told(first: str) -> None:
    mission = read(first, WAYPOINT)
    assert len(mission.items) == 2
    assert mission.home is None
    (finding,) = [finding for finding in mission.findings if finding.code == "L152"]
    assert (finding.item, finding.place) == (1, Place(2, 1))
    assert "QGroundControl takes it as home" in finding.message
    assert finding.severity is Severity.WARNING


@pytest.mark.parametrize(
    ("first", "altitude_amsl_m"),
    [
        (HOME, 488.0),
        (HOME.replace("\t16\t", "\t0\t"), 488.0),
        (HOME.replace("0\t1\t0\t", "0\t1\t5\t"), 488.0),
        ("0\t0\t3\t16\t0\t0\t0\t0\t47.1\t8.5\t0\t1", None),
        ("0\t0\t3\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1", None),
    ],
    ids=["plain", "command 0", "int frame", "relative and 0", "relative before a take-off"],
)
def test_a_home_row_is_not_flown(first: str, altitude_amsl_m: float | None) -> None:
    mission = read(first, TAKEOFF)
    assert [item.command for item in mission.items] == [22]
    assert mission.home == Home(
        latitude_deg=47.1, longitude_deg=8.5, altitude_amsl_m=altitude_amsl_m
    )
    assert mission.findings == ()


def test_mission_planners_blank_home_is_no_home() -> None:
    mission = read("0\t1\t0\t0\t0\t0\t0\t0\t0\t0\t0\t1", TAKEOFF)
    assert mission.home is None
    assert len(mission.items) == 1


def test_rows_numbered_from_1_keep_their_numbers_for_jumps() -> None:
    mission = read("1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1", WAYPOINT)
    assert [item.jump_id for item in mission.items] == [1, 2]
    assert codes(mission) == ["L152"]


def test_rows_out_of_sequence_are_numbered_by_their_order() -> None:
    mission = read(HOME, TAKEOFF, WAYPOINT, WAYPOINT.replace("47.2", "47.3"))
    assert [item.jump_id for item in mission.items] == [1, 2, 3]
    (finding,) = mission.findings
    assert (finding.code, finding.severity, finding.place) == ("L153", Severity.INFO, Place(5, 1))


def test_rows_out_of_sequence_are_a_warning_where_a_jump_depends_on_them() -> None:
    mission = read(HOME, TAKEOFF, WAYPOINT, "5\t0\t0\t177\t2\t3\t0\t0\t0\t0\t0\t1")
    assert [finding.severity for finding in mission.findings] == [Severity.WARNING]


def test_extra_columns_are_left_out_and_told() -> None:
    mission = read(HOME, TAKEOFF + "\t0\textra")
    assert len(mission.items) == 1
    assert codes(mission) == ["L155"]


def test_terrain_rows_are_told_once() -> None:
    row = "1\t0\t10\t16\t0\t0\t0\t0\t47\t8\t30\t1"
    mission = read(HOME, row, row.replace("1\t0", "2\t0", 1))
    (finding,) = mission.findings
    assert finding.code == "L160"
    assert finding.message.startswith("2 rows")
    assert finding.place == Place(3, 1)


@pytest.mark.parametrize(
    ("row", "column", "message"),
    [
        ("a", 1, "'a' is not a mission row"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t48.2 -3.0\t1", 1, "11 values, expected 12"),
        ("x\t0\t3\t16\t0\t0\t0\t0\t47\t8\t30\t1", 1, "sequence number is 'x'"),
        ("1\t0\t3.5\t16\t0\t0\t0\t0\t47\t8\t30\t1", 5, "frame is '3.5'"),
        ("1\t0\t3\tNAV\t0\t0\t0\t0\t47\t8\t30\t1", 7, "command is 'NAV'"),
        ("1\t0\t3\t-16\t0\t0\t0\t0\t47\t8\t30\t1", 7, "command is '-16'"),
        ("1\t0\t3\t70000\t0\t0\t0\t0\t47\t8\t30\t1", 7, "whole number from 0 to 65535"),
        ("1\t0\t3\t16\t1e400\t0\t0\t0\t47\t8\t30\t1", 10, "parameter 1 is '1e400'"),
        ("1\t0\t3\t16\tinf\t0\t0\t0\t47\t8\t30\t1", 10, "parameter 1 is 'inf'"),
        ("1\t0\t3\t16\t1_0\t0\t0\t0\t47\t8\t30\t1", 10, "parameter 1 is '1_0'"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t91\t8\t30\t1", 18, "latitude is '91'"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t47\t181\t30\t1", 21, "longitude is '181'"),
        ("1\t0\t6\t16\t0\t0\t0\t0\t473977420\t85455940\t30\t1", 18, "degrees × 10⁷"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t47,1\t8,5\t30\t1", 18, "decimal point"),
        ("0\t0\t16\t1\t1\t0\t0\t0\t0\t43183\t32130\t100\t1", 1, "make no sense"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t47\t8\t-100001\t1", 23, "altitude is '-100001'"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t47\t8\t30\tyes", 26, "autocontinue is 'yes'"),
    ],
)
def test_a_broken_row_is_refused_with_line_column_and_what_is_expected(
    row: str, column: int, message: str
) -> None:
    with pytest.raises(MissionFileError) as caught:
        read(HOME, row)
    assert message in str(caught.value)
    assert caught.value.place == Place(3, column)


def test_only_commands_with_a_place_have_their_place_checked() -> None:
    servo = "1\t0\t3\t183\t9\t1500\t0\t0\t1500\t1500\t0\t1"
    local = "2\t0\t1\t16\t0\t0\t0\t0\t120\t250\t-30\t1"
    assert len(read(HOME, servo, local).items) == 2


def test_unknown_commands_are_read() -> None:
    assert read(HOME, "1\t0\t3\t50001\t1\t2\t3\t4\t500\t600\t700\t1").items[0].command == 50001


def test_more_rows_than_mavlink_can_send_are_refused() -> None:
    text = "QGC WPL 110\n" + f"{HOME}\n" * 65_536
    with pytest.raises(MissionFileError, match="65,535 rows"):
        read_wpl(text, source="m")


def test_endless_blank_lines_are_refused() -> None:
    with pytest.raises(MissionFileError, match="1,000,000 lines"):
        read_wpl("QGC WPL 110\n" + "\n" * 1_000_001, source="m")


def test_an_endless_line_is_refused() -> None:
    with pytest.raises(MissionFileError, match="characters") as caught:
        read_wpl("QGC WPL 110\n" + "0\t" * 100_000, source="m")
    assert caught.value.place == Place(2, 1)


def test_the_file_is_kept_for_writing_back() -> None:
    text = f"QGC WPL 110\n{HOME}\n"
    assert read_wpl(text, source="m").document == text


def test_a_vehicle_kind_that_the_commands_prove_is_told() -> None:
    vtol = "1\t0\t3\t84\t0\t0\t0\t0\t47\t8\t20\t1"
    assert read(HOME, vtol).vehicle_kind is VehicleKind.VTOL
    assert read(HOME, TAKEOFF).vehicle_kind is None


@pytest.mark.parametrize(
    ("field", "texts"),
    [
        (0, ("7", "0007", "999999999", "2147483648", "-1", "1.0")),
        (1, ("1", "2147483648")),
        (2, ("0", "255", "256", "٣")),
        (3, ("16", "65535", "65536")),
        (4, ("-0.0", "0.10", "1e3", "+1", "1.", ".5", "nan", "1" + 38 * "0", "4" + 38 * "0")),
        (8, ("90", "-90.0000000", "90.0000001", "473977418")),
        (9, ("-180", "180.0000001")),
        (10, ("100000", "-100000.1")),
        (11, ("0", "255", "256")),
    ],
)
def test_a_row_as_ground_stations_write_it_reads_as_one_with_a_blank_after_it(
    field: int, texts: tuple[str, ...]
) -> None:
    # Only the first is read at once, the second field by field.
    def read(text: str, end: str) -> str:
        row = ["1", "0", "3", "16", "0", "0", "0", "0", "47.1", "8.2", "30.5", "1"]
        row[field] = text
        lines = ["QGC WPL 110", "0\t0\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1", "\t".join(row) + end]
        try:
            mission = read_wpl("\n".join(lines), source="a.waypoints")
        except MissionFileError as error:
            return str(error)
        return repr((mission.items, mission.home))

    for text in texts:
        assert read(text, "") == read(text, " ")
