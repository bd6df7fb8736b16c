"""What a simulation says of its vehicles, its weather and its pads: nothing unknown is clear."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import OUT, checked, pad, place, sortie, up, vehicles
from made_missions import item, mission, north, rtl
from made_swarm import MODEL, formation, search, simulated

from planner import catalogue
from planner.errors import UsageError
from planner.findings import Severity
from planner.geo.fence import Fence, FenceCircle
from planner.service.swarm_vehicles import LEFT_OUT
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Mission
    from planner.service.swarm import SwarmResult

EXCHANGE = '[swarm]\nalgorithm = "exchange"\nheight_m = 20\n'
PACKS = '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = 3\n'


def said(*tables: str, **missions: Mission) -> dict[str, list[str]]:
    """Return the messages of a simulation by their codes, infos left out."""
    return told(simulated(*tables, **missions))


def told(result: SwarmResult) -> dict[str, list[str]]:
    """Return the messages of what was simulated by their codes, infos left out."""
    found: dict[str, list[str]] = {}
    for one in result.findings:
        if one.severity > Severity.INFO:
            found.setdefault(one.code, []).append(one.message)
    return found


def exchanging(*, more: str = "", apart_m: float = 60.0, separation: str = "") -> str:
    """Two that change places; ``more`` is of the second."""
    return (
        f"[separation]\nhorizontal_m = 10\n{separation}"
        + pad("a", 0, 0)
        + pad("b", 0, apart_m)
        + EXCHANGE
        + PACKS
        + vehicles("a", model=MODEL)
        + vehicles("b", model=MODEL, more=more)
    )


def beside(kept_m: float, *, errors_m: tuple[float, float]) -> SwarmResult:
    """Return what becomes of two that fly 15 m beside each other all the way, kept apart by nobody."""
    conditions, table = "[conditions]\nposition_error_m = {!r}\n", "[vehicle.b]\n"
    tables = formation(15.0).replace("horizontal_m = 10", f"horizontal_m = {kept_m!r}")
    tables = tables.replace(table, f"{table}position_error_m = {errors_m[1]!r}\n")
    return simulated(conditions.format(errors_m[0]), tables, policy="none")


@pytest.mark.parametrize(
    ("errors_m", "is_near"),
    [
        # 2 m and both errors: 22 m, more than five times 2 m
        ((10.0, 10.0), True),
        # each counts for itself: 14.5 and 15.5 m
        ((0.0, 12.5), False),
        ((0.0, 13.5), True),
        ((13.5, 0.0), True),
    ],
)
def test_agents_keep_apart_by_their_separation_and_the_errors_of_both(
    *, errors_m: tuple[float, float], is_near: bool
) -> None:
    flown = beside(2.0, errors_m=errors_m)
    assert ("S128" in {one.code for one in flown.findings}) is is_near
    assert flown.separation_m == 2.0 + 2.0 * max(errors_m)
    [near] = flown.distances.nearest
    assert near.distance_m == pytest.approx(15.0, abs=0.05)  # the earth is no ball here


def test_agents_that_keep_their_separation_exactly_come_no_nearer() -> None:
    [near] = beside(10.0, errors_m=(0.0, 0.0)).distances.nearest
    # places are rounded to far less than a micrometre
    exact, wider = (
        beside(near.distance_m + more_m, errors_m=(0.0, 0.0)) for more_m in (1e-9, 1e-5)
    )
    assert "S128" not in {one.code for one in exact.findings}
    assert "S128" in {one.code for one in wider.findings}


def test_nobody_lands_on_a_pad_where_another_still_stands() -> None:
    assert "S116" not in said(exchanging())
    waiting = said(exchanging(more="available_from_s = 100"))
    # position errors of 2.5 m each
    [message] = waiting["S116"]
    assert message.startswith("a and b: ")
    assert "on the ground at " in message
    assert message.endswith("5.0 m required")
    # places that are known exactly are no less taken
    exact = exchanging(
        more="available_from_s = 100", separation="[conditions]\nposition_error_m = 0\n"
    )
    assert said(exact)["S116"]


def test_pads_are_as_far_apart_as_the_ground_asks_for() -> None:
    for ground, near_m, far_m in (("", 4.9, 5.1), ("ground_m = 11\n", 10.9, 11.1)):
        for apart_m, is_near in ((near_m, True), (far_m, False)):
            tables = formation(apart_m).replace(
                "horizontal_m = 10\n", f"horizontal_m = 10\n{ground}"
            )
            assert ("S116" in told(simulated(tables, until_s=60.0))) is is_near, (ground, apart_m)


def test_weather_and_loads_that_a_model_does_not_count_are_said_of_all_it_moves() -> None:
    wind = said('[conditions]\nwind = "2@270"\n', search())["S142"]
    assert "v0, v1: wind of 2.0 m/s not counted: this model has no airspeed term (E108)" in wind
    blown = said('[conditions]\nwind = "20@270"\n', search())["S142"]
    assert any("no headway" in one and "(W103)" in one for one in blown)
    assert not simulated('[conditions]\nwind = "20@270"\n', search()).is_clear
    loaded = simulated(search(more="").replace("[vehicle.v0]\n", "[vehicle.v0]\npayload_kg = 3\n"))
    assert any("v0: payload of 3.00 kg" in one.message for one in loaded.findings)
    assert not loaded.is_clear
    assert "S142" not in said(search())


def test_who_flies_faster_than_its_model_was_identified_is_not_clear() -> None:
    """The article's model is identified up to 10 m/s."""
    for speed_m_s, is_known in ((10.0, True), (10.1, False)):
        tables = f"[conditions]\nspeed_m_s = {speed_m_s}\n"
        assert (
            any("(E105)" in one for one in said(tables, search()).get("S142", ())) is not is_known
        )
        assert simulated(tables, search()).is_clear is is_known


def test_what_is_not_counted_costs_margin() -> None:
    """Of air at -20 °C nothing is; of 5 m/s of wind the bound of a check, as part of what is flown."""
    calm = simulated(search())
    windy = simulated('[conditions]\nwind = "5@270"\n', search())
    energies_wh = [one.energy_wh for one in windy.agents]
    assert energies_wh == [one.energy_wh for one in calm.agents]
    assert windy.is_clear
    left_wh = [one.battery.margin_wh for one in windy.agents if one.battery is not None]
    used_wh = max(one for one in energies_wh if one is not None)
    # a pack that holds the flight and a twentieth of it more
    assert min(left_wh) > 0.05 * used_wh
    volts = 14.8
    packs_wh = 5.2 * volts - (min(left_wh) - 0.05 * used_wh) / 0.8
    packs = (
        f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "{packs_wh / volts:.3f}Ah@14.8V"\ncount = 2\n'
    )
    # they hold it against their batteries, and fly home sooner
    turned_s = []
    for wind in ("", '[conditions]\nwind = "5@270"\n'):
        flown = simulated(wind, search(packs=packs))
        assert "S131" not in {one.code for one in flown.findings}
        turned_s.append(min(one.turned_back_s or np.inf for one in flown.agents))
    assert turned_s[1] < turned_s[0]


def test_what_is_not_counted_costs_margin_of_missions_as_filed() -> None:
    out = mission(up(20), place(400, 0, 20), rtl())

    def flown(volt_ampere_hours: float, wind: str) -> SwarmResult:
        battery = f"{volt_ampere_hours / 14.8:.4f}Ah@14.8V"
        pack = f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "{battery}"\ncount = 1\n'
        tables = (
            "[separation]\nhorizontal_m = 10\n"
            + pad("a", 0, 0).replace("400", "0")
            + vehicles("a", model=MODEL)
        )
        return simulated(wind + tables + pack, sortie("s", "a", 0.0, more='pack = "P"'), out=out)

    taken_wh = flown(77.0, "").energy_wh
    assert taken_wh is not None
    packs_wh = 1.02 * taken_wh / 0.8
    assert "S131" not in {one.code for one in flown(packs_wh, "").findings}
    [short] = [
        one.message
        for one in flown(packs_wh, '[conditions]\nwind = "5@270"\n').findings
        if one.code == "S131"
    ]
    assert "more in wind and air that its model does not count: " in short


def test_the_plane_is_above_every_pad() -> None:
    """20 m above the first pad, which is at 400 m."""
    tables = exchanging()
    at = tables.rindex("amsl_m = 400")

    def with_pad_at(amsl_m: float) -> str:
        return tables[:at] + f"amsl_m = {amsl_m}" + tables[at + len("amsl_m = 400") :]

    with pytest.raises(UsageError, match=r"above pad b: give 1\.0 m or more above each"):
        simulated(with_pad_at(419.5))
    assert simulated(with_pad_at(418.5)).agents


def test_hours_of_vehicles_and_jobs_are_kept() -> None:
    landed_s = simulated(exchanging()).landed_s
    late = said(exchanging(more=f"available_until_s = {landed_s - 5.0}"))
    assert ["b is available until" in one for one in late["S138"]] == [True]
    assert "S138" not in said(exchanging(more=f"available_until_s = {landed_s + 5.0}"))
    tables = pad("a", 0, 0) + PACKS + vehicles("a", model=MODEL) + sortie("s", "a", 0.0)
    ends_s = simulated(tables, out=OUT).landed_s
    for more_s, is_late in ((1.0, False), (-1.0, True)):
        job = f"latest_s = {ends_s + more_s}\n"
        found = said(job + tables, out=OUT).get("S138", [])
        assert any("out has to be done by" in one for one in found) is is_late


def test_a_wait_until_a_time_of_day_is_not_clear() -> None:
    waits = mission(
        up(20), item(93, None, 0.0, params=(-1.0, 12.0, 0.0, 0.0)), place(100, 0, 20), rtl()
    )
    tables = (
        pad("a", 0, 0) + PACKS + vehicles("a", model="arducopter-sitl-quad") + sortie("s", "a", 0.0)
    )
    flown = simulated(tables, out=waits)
    [message] = [one.message for one in flown.findings if one.code == "S127"]
    assert "12:00:00 UTC" in message
    assert not flown.is_clear


def test_gusts_count_with_the_wind_they_come_in() -> None:
    """The survey quadrotor was identified up to some airspeed: gusts and wind together reach it."""
    one = search(agents=1).replace(MODEL, "arducopter-sitl-quad")
    fault = '[fault.f]\nkind = "gusts"\nwind_m_s = 9.0\n'
    calm, windy = simulated(one, fault), simulated('[conditions]\nwind = "9@270"\n', one, fault)
    [flown] = windy.agents
    assert flown.flight is not None
    known = flown.flight.power.vehicle.valid_for.speed_m_s
    assert known is not None
    beyond = flown.strongest_gust_m_s + 9.0 >= known.high
    assert calm.agents[0].strongest_gust_m_s < known.high
    assert ("S140" in {found.code for found in windy.findings}) is beyond
    # without the wind only that it is missing is told
    assert not any("meets a gust" in found.message for found in calm.findings)
    assert math.isfinite(windy.landed_s)


QUADS = pad("a", 0, 0) + vehicles("a") + sortie("s", "a", 0.0)
TO_AND_FRO = (place(100, 0, 20), rtl())


@pytest.mark.parametrize(
    ("flown", "said_of_it"),
    [
        # AP_Arming and ModeAuto::init: no take-off, no mission on the ground
        (mission(*TO_AND_FRO), "s: item 1: the flight begins with NAV_WAYPOINT"),
        (mission(up(20), *TO_AND_FRO), ""),
        # auxiliary functions: 31 stops the motors, 9 is a camera's trigger
        (
            mission(up(20), item(218, None, 0.0, params=(31.0, 2.0, 0.0, 0.0)), *TO_AND_FRO),
            "s: item 2: DO_AUX_FUNCTION 31 is not modelled",
        ),
        (mission(up(20), item(218, None, 0.0, params=(9.0, 2.0, 0.0, 0.0)), *TO_AND_FRO), ""),
    ],
)
def test_a_mission_that_is_not_flown_as_simulated_is_not_clear(
    flown: Mission, said_of_it: str
) -> None:
    result = simulated(QUADS, out=flown)
    assert result.is_clear is not bool(said_of_it)
    told = [one.message for one in result.findings if one.code == "S142"]
    assert [one[: len(said_of_it)] for one in told] == [said_of_it] * bool(said_of_it)


def test_what_a_simulation_says_it_leaves_out_does_not_count() -> None:
    """A fence across the way: an error of a check."""
    circle = FenceCircle(
        inclusion=False, latitude_deg=north(100.0), longitude_deg=8.0, radius_m=20.0
    )
    fenced = replace(mission(up(20), *TO_AND_FRO), fence=Fence(circles=(circle,)))
    codes = {one.code for one in checked(QUADS, out=fenced).all_findings}
    assert "F101" in codes
    result = simulated(QUADS, out=fenced)
    assert result.is_clear
    [unchecked] = [one.message for one in result.findings if one.code == "S133"]
    assert unchecked.startswith("fences, terrain, ")
    known = catalogue.rules()
    for codes_of in LEFT_OUT.values():
        for code in codes_of:
            assert code in known or code in catalogue.FAMILIES


@pytest.mark.parametrize(
    ("model", "line", "is_left_out"),
    [
        # a return over terrain that is not given: A104
        ("arducopter-sitl-quad", "RTL_ALT_TYPE,1", True),
        # whether the least thrust, 0.8 of a hover that nobody measured, lets it descend: T118
        ("px4-quad-2kg", "1\t1\tMPC_THR_MIN\t0.4\t9", False),
    ],
)
def test_what_could_not_be_checked_counts_as_what_it_is_about(
    tmp_path: Path, model: str, line: str, *, is_left_out: bool
) -> None:
    file = tmp_path / "a.params"
    file.write_text(f"{line}\n", encoding="utf-8")
    tables = pad("a", 0, 0) + vehicles("a", model=model, more=f'params = "{file}"')
    tables += sortie("s", "a", 0.0)
    out = mission(up(20), place(100, 0, 20), item(20, frame=2))
    assert "X904" in {one.code for one in checked(tables, out=out).all_findings}
    told = said(tables, out=out).get("S142", [])
    assert any("(X904)" in one for one in told) is not is_left_out, told


def test_a_vehicle_that_would_not_arm_is_not_clear(tmp_path: Path) -> None:
    """PX4 with COM_ARMABLE 0, in a swarm too."""
    for value, is_ready in ((1, True), (0, False)):
        file = tmp_path / f"{value}.params"
        file.write_text(f"1\t1\tCOM_ARMABLE\t{value}\t6\n", encoding="utf-8")
        tables = search(agents=1).replace(MODEL, "px4-quad-2kg")
        tables = tables.replace("[vehicle.v0]\n", f'[vehicle.v0]\nparams = "{file}"\n')
        told = said(tables).get("S142", [])
        assert any("(M127)" in one for one in told) is not is_ready, told


def test_who_never_took_off_has_not_failed_to_land() -> None:
    ready = exchanging(more="available_from_s = 500")
    [message] = told(simulated(ready, until_s=200.0))["S130"]
    assert message == "b has not taken off"


def test_what_the_check_of_a_vehicle_takes_is_no_word_of_the_swarm() -> None:
    """The flight that stands for what it does has no reserve of the pack of the agent."""
    cold = exchanging(separation="[conditions]\ntemperature_c = 12\n").replace("5.2Ah", "0.1Ah")
    assert (
        "a, b: temperature of 12 °C not counted: this model has no air density term (E108)"
        in (said(cold)["S142"])
    )


def test_nobody_flies_low_over_one_that_stands() -> None:
    """b waits on its pad 60 m east of a's, and a flies there: 10 m and two height errors of 2.5 m above."""
    tables = exchanging(more="available_from_s = 100", separation="height_error_m = 2.5\n")
    for height_m, is_low in ((14.9, True), (15.0, False)):
        found = said(tables.replace("height_m = 20", f"height_m = {height_m}")).get("S128", [])
        assert [one.split(":")[0] for one in found] == ["b", "a"] * is_low
        for message in found:
            assert message.endswith("; 15 m beside or 15 m above required")
            assert " m beside and just under 15 m above " in message
    # the plane is as high above the first pad, and b stands higher
    uneven = tables.replace("amsl_m = 400", "amsl_m = 407").replace("407", "400", 1)
    assert any("beside and 13 m above b" in one for one in said(uneven)["S128"])


@pytest.mark.parametrize(("wind", "is_known"), [("", False), ("9.9@0", False), ("10@0", True)])
def test_gusts_belong_to_a_wind_that_blows(wind: str, *, is_known: bool) -> None:
    gusts = '[fault.g]\nkind = "gusts"\nwind_m_s = 10.0\n'
    given = f'[conditions]\nwind = "{wind}"\n' if wind else ""
    tables = search(agents=1).replace(MODEL, "arducopter-sitl-quad")
    messages = said(given + gusts + tables).get("S140", [])
    assert (
        any("gusts of a wind of 10.0 m/s, and a wind of" in one for one in messages) is not is_known
    )
