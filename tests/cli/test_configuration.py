"""Settings from files: where they are found, and how wrong ones are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.autopilot import Autopilot, Target
from planner.cli.configuration import (
    OWN_FILE,
    common_settings,
    find_configuration,
    mission_settings,
    read_configuration,
)
from planner.cli.main import main
from planner.errors import ConfigurationError, UsageError
from planner.findings import Severity
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.selection import Selection
from planner.setting import Group, Setting
from planner.setup import SETTINGS_FILE, Output, Setup, Together, settings


def _own(folder: Path, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "mavjoule.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_not_known_exactly_is_text_with_its_standard_deviation(tmp_path: Path) -> None:
    _own(
        tmp_path,
        """
        wind = "5±2@270±20"
        payload_kg = "0.5+-0.1"
        temperature_c = "15±5"
        charge = "95±2%"
        risk = "1%"
        """,
    )
    setup = Setup.of(mission_settings(str(tmp_path / "a.plan"), {}))
    assert setup.wind == Wind(speed_m_s=5.0, from_deg=270.0, speed_sd_m_s=2.0, from_sd_deg=20.0)
    assert setup.payload_kg == Spread(mean=0.5, sd=0.1)
    assert setup.temperature_c == Spread(mean=15.0, sd=5.0)
    assert setup.charge == Spread(mean=0.95, sd=0.02)
    assert setup.risk == 0.01


def test_every_setting_can_stand_in_a_file(tmp_path: Path) -> None:
    _own(
        tmp_path,
        """
        vehicle = "models/mine.toml"
        params = "mine.param"
        terrain = ["north.tif", "south.tif"]
        autopilot = "px4"
        target = "px4-1.16"
        clearance_m = 15
        profile = "site.toml"
        battery = "5.2Ah@14.8V"
        charge = "95%"
        reserve = 0.25
        risk = "10%"
        speed_m_s = 6.5
        payload_kg = 0.5
        wind = "5@270"
        wind_profile = "power:0.2@10"
        battery_health = "85%"
        battery_resistance_factor = 1.5
        battery_temperature_c = 5
        home_amsl_m = 488
        temperature_c = -5.5
        pressure_hpa = 990
        position_noise_m = 0.3
        heading_deg = 95
        reaction_time_s = 1.5
        position_error_m = 3
        select = ["E", "F"]
        extend_select = "A1"
        ignore = "E107, T"
        baseline = "known.json"
        fail_on = "warning"
        separation_m = 5
        min_nav_alt_m = 3
        start_error_s = 2
        format = "json"
        statistics = true
        [per_file_ignores]
        "a.plan" = "E105"
        "b.plan" = "F1"
        """,
    )
    values = mission_settings(str(tmp_path / "a.plan"), {})
    named = values.pop(SETTINGS_FILE)
    in_file = {key for key, setting in settings().items() if setting.in_file}
    assert set(values) == in_file, "this test names every setting"
    assert named.path == OWN_FILE
    texts = dict(named.values)
    assert set(texts) == in_file
    assert (texts["battery"], texts["ignore"], texts["statistics"]) == (
        "5.2Ah@14.8V",
        "E107,T",
        "true",
    )
    assert texts["terrain"] == f"{tmp_path / 'north.tif'},{tmp_path / 'south.tif'}"
    assert texts["per_file_ignores"] == "E105"
    assert [one.codes for one in values.pop("per_file_ignores")] == [("E105",)]
    paths = {
        key: values.pop(key) for key in ("vehicle", "params", "terrain", "profile", "baseline")
    }
    assert paths == {
        "vehicle": str(tmp_path / "models/mine.toml"),
        "params": tmp_path / "mine.param",
        "terrain": (tmp_path / "north.tif", tmp_path / "south.tif"),
        "profile": tmp_path / "site.toml",
        "baseline": tmp_path / "known.json",
    }
    setup = Setup.of(values)
    assert setup.autopilot is Autopilot.PX4
    assert setup.target == Target(Autopilot.PX4, (1, 16))
    assert setup.clearance_m == 15.0
    assert setup.battery is not None
    assert setup.battery.energy_wh == pytest.approx(76.96)
    assert (setup.charge, setup.reserve, setup.risk) == (0.95, 0.25, 0.1)
    assert setup.speed_m_s == 6.5
    assert setup.wind == Wind(
        speed_m_s=5.0, from_deg=270.0, reference_height_m=10.0, shear_exponent=0.2
    )
    assert setup.battery_health == 0.85
    assert setup.battery_resistance_factor == 1.5
    assert setup.battery_temperature_c == 5.0
    assert setup.payload_kg == 0.5
    assert setup.home_amsl_m == 488.0
    assert setup.temperature_c == -5.5
    assert setup.pressure_hpa == 990.0
    assert setup.position_noise_m == 0.3
    assert setup.heading_deg == 95.0
    assert setup.reaction_time_s == 1.5
    assert setup.position_error_m == 3.0
    assert setup.selection == Selection(
        select=("E", "F"), extend_select=("A1",), ignore=("E107", "T")
    )
    assert setup.fail_on is Severity.WARNING
    together = Together.of(common_settings([values, values], Together))
    assert together == Together(separation_m=5.0, min_nav_alt_m=3.0, start_error_s=2.0)
    assert Output.of(common_settings([values], Output)) == Output(format="json", statistics=True)


def test_the_nearest_folder_wins_alone(tmp_path: Path) -> None:
    _own(tmp_path, 'reserve = "30%"\ncharge = "90%"\n')
    _own(tmp_path / "near", 'reserve = "40%"\n')
    (tmp_path / "near" / "deep").mkdir()
    assert find_configuration(tmp_path / "near" / "deep").values == {"reserve": 0.4}
    assert find_configuration(tmp_path).values == {"reserve": 0.3, "charge": 0.9}


def test_a_table_of_pyproject_serves_as_well_and_one_without_is_passed_over(tmp_path: Path) -> None:
    shared = tmp_path / "pyproject.toml"
    shared.write_text('[tool.mavjoule]\nreserve = "35%"\n', encoding="utf-8")
    near = tmp_path / "near"
    near.mkdir()
    (near / "pyproject.toml").write_text("[tool.other]\nbroken = ", encoding="utf-8")
    assert find_configuration(near).values == {"reserve": 0.35}
    _own(tmp_path, 'reserve = "15%"\n')
    assert find_configuration(near).values == {"reserve": 0.15}


def test_a_key_is_spelled_with_hyphens_as_well(tmp_path: Path) -> None:
    _own(tmp_path, 'fail-on = "warning"\n')
    assert find_configuration(tmp_path).values == {"fail_on": Severity.WARNING}


def test_a_folder_without_any_has_no_settings(tmp_path: Path) -> None:
    assert find_configuration(Path(tmp_path.anchor)).values == {}


def test_the_command_line_beats_the_file(tmp_path: Path) -> None:
    _own(tmp_path, 'reserve = "30%"\nautopilot = "px4"\nvehicle = "px4-sih-quad"\n')
    merged = mission_settings(str(tmp_path / "a.plan"), {"reserve": 0.1, "autopilot": "auto"})
    assert merged["reserve"] == 0.1
    assert merged[SETTINGS_FILE].values == (("vehicle", "px4-sih-quad"),)
    setup = Setup.of(merged)
    assert setup.autopilot is None
    assert setup.vehicle.name == "px4-sih-quad"


def test_standard_input_takes_the_configuration_of_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _own(tmp_path, 'reserve = "30%"\n')
    monkeypatch.chdir(tmp_path)
    values = mission_settings("-", {})
    assert values.pop(SETTINGS_FILE).values == (("reserve", "30%"),)
    assert values == {"reserve": 0.3}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('reserv = "20%"', "reserv is not a setting; did you mean reserve?"),
        ("payload = 1.0", "payload is not a setting; did you mean payload_kg?"),
        ("reserve = 20", "reserve: '20' is ambiguous"),
        ("reserve = true", "reserve: must be text or number, got true"),
        ("home_amsl_m = '488'", "home_amsl_m: must be number, got '488'"),
        ("payload_kg = nan", "payload_kg: must be text or number, got nan"),
        (
            "payload_kg = '0.5±'",
            "payload_kg: expected a value and its standard deviation, such as 5±2",
        ),
        ("payload_kg = -1", "payload_kg: expected 0 to 1000 kg, got '-1'"),
        ("vehicle = 1", "vehicle: must be name of a vehicle model or path of its file, got 1"),
        ("statistics = 1", "statistics: must be true or false, got 1"),
        ("exit_zero = true", "exit_zero may not be set by a file: give --exit-zero"),
        ("select = [1]", "select: must be text or list of texts, got [1]"),
        ("ignore = 'Q999'", "ignore: no rule's code begins with 'Q999'"),
        (
            "format = 'xml'",
            "format: expected one of text, concise, json, json-lines, sarif, junit, github, gitlab",
        ),
        ("fail_on = 'info'", "fail_on: expected one of error, warning, got 'info'"),
        ("autopilot = 'apm'", "autopilot: expected one of auto, step, px4, ardupilot, got 'apm'"),
        (
            "battery = '5Ah'",
            "battery: expected a battery, such as 5.2Ah@14.8V, 5.2Ah@4S or 77Wh, got '5Ah'",
        ),
        ("wind = 5", "wind: expected speed and the direction it blows from"),
        ("params = []", "params: must be path, got []"),
        ("fail-on = 'error'\nfail_on = 'error'", "fail_on is given twice"),
        ("per_file_ignores = 'E1'", "per_file_ignores: must be table of codes by file, got 'E1'"),
        (
            "[per-file-ignores]\n'a.plan' = 'E1O1'",
            "per-file-ignores: 'a.plan': no rule's code begins with 'E1O1'; did you mean E1",
        ),
        (
            "[per_file_ignores]\na = 1",
            "per_file_ignores: 'a': must be text or list of texts, got 1",
        ),
        (
            "[per_file_ignores]\n'a.plan#0' = 'E1'",
            "per_file_ignores: 'a.plan#0': items count from 1",
        ),
        (
            "[per_file_ignores]\n'../a' = 'E1'",
            "per_file_ignores: '../a': must be a path below this",
        ),
        ("[per_file_ignores]\n'/a' = 'E1'", "per_file_ignores: '/a': must be a path below this"),
        ("[per_file_ignores]\n'a\\b' = 'E1'", "per_file_ignores: 'a\\\\b': must be a path below"),
        ("reserve = [", "is not TOML: "),
        ("a = 1\na = 2", "is not TOML: Cannot overwrite a value"),
        ("[tool.mavjoule]\nreserve = 0.2", "tool is not a setting"),
    ],
)
def test_a_wrong_file_is_one_sentence_with_file_and_key(
    tmp_path: Path, text: str, sentence: str
) -> None:
    path = _own(tmp_path, text)
    with pytest.raises(ConfigurationError) as caught:
        find_configuration(tmp_path)
    assert str(caught.value).startswith(f"{path}: {sentence}")
    assert "\n" not in str(caught.value)


def test_the_key_of_a_shared_file_is_named_with_its_table(tmp_path: Path) -> None:
    path = tmp_path / "pyproject.toml"
    path.write_text("[tool.mavjoule]\nwinds = 1\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"tool\.mavjoule\.winds is not a setting"):
        read_configuration(path)
    path.write_text("[tool]\nmavjoule = 1\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"tool\.mavjoule must be a table, got 1"):
        read_configuration(path)


def test_a_file_that_is_no_text_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "mavjoule.toml").write_bytes(b"reserve = 0.2\n# \xff\n")
    with pytest.raises(ConfigurationError, match=r"not UTF-8 text.*\(line 2"):
        find_configuration(tmp_path)


def test_configurations_that_disagree_about_the_whole_call_are_refused() -> None:
    with pytest.raises(UsageError, match="disagree about format: give --format"):
        common_settings([{"format": "json"}, {}], Output)
    same = [{"format": "json"}, {"format": "json"}]
    assert common_settings(same, Output) == {"format": "json"}


@pytest.mark.parametrize("key", ["vehicle", "params", "profile", "terrain", "baseline"])
def test_an_empty_path_or_name_is_refused_by_its_key(tmp_path: Path, key: str) -> None:
    path = _own(tmp_path, f'{key} = ""')
    with pytest.raises(ConfigurationError, match=rf"mavjoule.toml: {key}: .* got an empty text"):
        read_configuration(path)


def test_a_folder_by_the_name_of_the_file_is_no_absence(tmp_path: Path) -> None:
    (tmp_path / "mavjoule.toml").mkdir()
    with pytest.raises(ConfigurationError, match=r"mavjoule.toml: must be a file"):
        find_configuration(tmp_path)


def test_a_link_to_nothing_by_the_name_of_the_file_is_no_absence(tmp_path: Path) -> None:
    (tmp_path / "mavjoule.toml").symlink_to(tmp_path / "gone.toml")
    with pytest.raises(ConfigurationError, match=r"mavjoule.toml: cannot be read"):
        find_configuration(tmp_path)


def test_a_folder_by_the_shared_name_belongs_to_somebody_else(tmp_path: Path) -> None:
    (tmp_path / "a" / "pyproject.toml").mkdir(parents=True)
    _own(tmp_path, "payload_kg = 0.5")
    assert find_configuration(tmp_path / "a").values == {"payload_kg": 0.5}


WRITING = [
    setting
    for setting in settings().values()
    if setting.group is Group.REPORT and setting.kind.is_file
]


@pytest.mark.parametrize("setting", WRITING, ids=lambda setting: setting.key)
@pytest.mark.parametrize("file", [OWN_FILE, "pyproject.toml"])
def test_a_file_beside_a_mission_names_nothing_to_write(
    tmp_path: Path, setting: Setting, file: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    victim = tmp_path / "profile"
    victim.write_text("mine", encoding="utf-8")
    (tmp_path / "cloned").mkdir()
    Path(mission).rename(tmp_path / "cloned" / mission)
    table = "[tool.mavjoule]\n" if file == "pyproject.toml" else ""
    (tmp_path / "cloned" / file).write_text(
        f'{table}{setting.key} = "../profile"', encoding="utf-8"
    )
    for command in ("check", "segments", "speed", "split"):
        assert main([command, f"cloned/{mission}"]) == 2
        assert f"may not be set by a file: give {setting.option}" in capsys.readouterr().err
    assert victim.read_text(encoding="utf-8") == "mine"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["cloned", "profile"]


def test_the_settings_that_write_are_all_of_the_report() -> None:
    assert {setting.key for setting in WRITING} == {"output", "trace", "export", "report", "plots"}
    assert not any(setting.in_file for setting in WRITING)
