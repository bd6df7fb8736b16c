"""Family S: several vehicles, in a fleet file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from made_fleet import OUT, PACK, SEPARATION, SWAP, checked, pad, place, sortie, up, vehicles
from made_missions import item, mission, north, rtl
from made_swarm import MODEL, fleet_of, formation, search, simulated
from rule_cases.case import RuleCases

from planner.service.swarm import simulate_fleet
from planner.service.swarm_agents import NumbersLimits, simulate_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.fleet.swarm.situation import SwarmSituation
    from planner.mission.items import Mission, MissionItem

PADS = pad("a", 0, 0) + pad("b", 0, 200)
ALONE = pad("a", 0, 0) + vehicles("a")
SWARM = ALONE + '[swarm]\nalgorithm = "exchange"\nheight_m = 20\n'
TWO = SEPARATION + PADS + vehicles("a", "b")


def found(*tables: str, **missions: Mission) -> tuple[Finding, ...]:
    """Return what is found of a fleet as a whole."""
    return tuple(one.finding for one in checked(*tables, **missions).findings)


def one_s() -> float:
    """Return the time of a single flight."""
    return checked(ALONE, sortie("s1", "a", 0.0)).sorties[0].time_s


def pack_again(after_s: float) -> tuple[Finding, ...]:
    """Two vehicles on one pack, the second so long after the first has landed."""
    pack = 'pack = "P"'
    second = sortie("s2", "b", one_s() + after_s, more=pack)
    return found(TWO, SWAP, PACK, sortie("s1", "a", 0.0, more=pack), second)


def charged(charge: float) -> tuple[Finding, ...]:
    """A sortie on a pack that is so full."""
    first = sortie("s1", "a", 0.0, more='pack = "P"')
    return found(ALONE, SWAP, f"{PACK}charge = {charge!r}\n", first)


def charger(air_c: float) -> tuple[Finding, ...]:
    """A pack flown twice, whose charger stands in such air."""
    sorties = [sortie(f"s{n}", "a", 2000.0 * n, more='pack = "P"') for n in range(2)]
    return found(ALONE, SWAP, PACK, f"[charger.bench]\nc_rate = 1\nair_c = {air_c!r}\n", *sorties)


def vehicle_again(after_s: float) -> tuple[Finding, ...]:
    """A vehicle that starts again so long after it has landed."""
    return found(ALONE, SWAP, sortie("s1", "a", 0.0), sortie("s2", "a", one_s() + after_s))


def one_pad(start_s: float) -> tuple[Finding, ...]:
    """Two vehicles from one pad, the second so long after the first; a swap takes a minute."""
    both = vehicles("a") + vehicles("b").replace('pad = "b"', 'pad = "a"')
    tables = SEPARATION + pad("a", 0, 0) + both
    return found(tables, SWAP, sortie("s1", "a", 0.0), sortie("s2", "b", start_s))


def needing(needs: str) -> tuple[Finding, ...]:
    """A job with such needs for a vehicle that carries a lamp."""
    job = f'[job.out]\nmission = "out.plan"\nneeds = {needs}\n'
    tables = pad("a", 0, 0) + vehicles("a", more='equipment = ["lamp"]')
    return found(job, tables, sortie("s1", "a", 0.0), out=OUT)


def until(before_s: float) -> tuple[Finding, ...]:
    """An operation that has to end so long before the only landing."""
    return found(ALONE, f"[operation]\nlatest_s = {one_s() - before_s!r}\n", sortie("s1", "a", 0.0))


def part(metres_north: float) -> tuple[Finding, ...]:
    """A job whose only sortie flies so far, where 100 m are asked for."""
    own = mission(up(20), place(metres_north, 0, 20), rtl())
    flown = sortie("s1", "a", 0.0, more='mission = "part_1.plan"')
    return found(ALONE, flown, out=OUT, part_1=own)


def powered(model: str) -> tuple[Finding, ...]:
    """A sortie of a vehicle of a model."""
    return found(pad("a", 0, 0) + vehicles("a", model=model), sortie("s1", "a", 0.0))


def over(height_m: float) -> tuple[Finding, ...]:
    """Two that fly towards each other, one so high above the other; 10 m and twice 2.5 m are asked for."""
    tables = "[separation]\nhorizontal_m = 5\nabove_m = 10\n" + pad("a", 0, 0) + pad("b", 200, 0)
    back = mission(
        up(20 + height_m), place(0, 0, 20 + height_m), place(200, 0, 20 + height_m), rtl()
    )
    there = mission(up(20), place(200, 0, 20), place(0, 0, 20), rtl())
    first = sortie("s1", "a", 0.0, job="there")
    return found(
        tables,
        vehicles("a", "b"),
        first,
        sortie("s2", "b", 0.0, job="back"),
        there=there,
        back=back,
    )


def beside_the_way_home(height_m: float) -> tuple[Finding, ...]:
    """One around three sides of a square at 40 m, another over its middle, so much higher."""
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 50, 50) + vehicles("a", "b")
    around = mission(
        up(40), place(0, 100, 40), place(100, 100, 40), place(0, 100, 40), place(0, 0, 40), rtl()
    )
    hover = mission(up(40 + height_m), place(50, 50, 40 + height_m, 120.0), rtl())
    first = sortie("s1", "a", 30.0, job="around")
    return found(tables, first, sortie("s2", "b", 0.0, job="hover"), around=around, hover=hover)


def pads_apart(metres: float) -> tuple[Finding, ...]:
    """Two that take off together so far from each other, where 5 m are asked for."""
    tables = SEPARATION + "ground_m = 5\n" + pad("a", 0, 0) + pad("b", 0, metres)
    east = mission(up(20), place(100, metres, 20), rtl())
    sorties = sortie("s1", "a", 0.0, job="out"), sortie("s2", "b", 0.0, job="east")
    return found(tables, vehicles("a", "b"), *sorties, out=OUT, east=east)


def layers(step_m: float) -> tuple[Finding, ...]:
    """Layers so far apart, where 5 m of separation and twice 2.5 m of height errors are needed."""
    tables = TWO + f"[layers]\nlowest_m = 40\nhighest_m = 80\nstep_m = {step_m!r}\n"
    return found(tables, sortie("s1", "a", 0.0), sortie("s2", "b", 1000.0))


def what_if(*tables: str, **missions: Mission) -> tuple[Finding, ...]:
    """Return what is found of a fleet whose contingencies are judged."""
    return tuple(one.finding for one in checked(*tables, what_if=True, **missions).findings)


def spare(before_s: float) -> tuple[Finding, ...]:
    """A vehicle and a spare one farther away; the day ends so long before the spare one would be back."""
    tables = TWO + "[operation]\nlatest_s = {!r}\n"
    from_b_s = checked(TWO, sortie("s1", "b", 0.0)).sorties[0].time_s
    return what_if(tables.format(from_b_s - before_s), sortie("s1", "a", 0.0))


def ageing(fraction: float) -> tuple[Finding, ...]:
    """A sortie on so much of the pack that, at 90 % of its health, it leaves 20 % of."""
    hover = mission(up(20), place(50, 0, 20, 900.0), rtl())
    tables = pad("a", 0, 0) + vehicles("a", model="falkowski-2023-quadrotor") + SWAP
    first = sortie("s1", "a", 0.0, more='pack = "P"')
    taken_wh = checked(tables, PACK, first, out=hover).sorties[0].energy_wh
    assert taken_wh is not None
    pack = f'[pack.P]\nbattery = "{fraction * taken_wh / 0.9 / 0.8!r}Wh"\n'
    return what_if(tables, pack, first, out=hover)


def late(before_s: float) -> tuple[Finding, ...]:
    """A sortie that may start 10 s late, and a day that ends so long before it then is back."""
    [alone] = checked(ALONE, sortie("s1", "a", 0.0)).sorties
    assert alone.assessment is not None
    slowest_s = alone.assessment.totals.time_s_p90
    assert slowest_s is not None
    tables = "[separation]\nhorizontal_m = 5\nstart_error_s = 10\n"
    tables += f"[operation]\nlatest_s = {slowest_s + 10.0 - before_s!r}\n"
    return what_if(ALONE, tables, sortie("s1", "a", 0.0))


def put_beside(metres: float) -> tuple[Finding, ...]:
    """One that lands elsewhere, and another put so far beside its home while it may still return."""
    tables = SEPARATION + SWAP + pad("a", 0, 0) + pad("b", 0, metres) + vehicles("a", "b")
    tables += vehicles("c").replace('pad = "c"', 'pad = "b"')
    away = mission(up(20), place(100, 0, 20, 60.0), item(21, north(100), 0.0))
    first = sortie("s1", "a", 0.0, job="away")
    return what_if(
        tables, first, sortie("s2", "b", 170.0), sortie("s3", "c", 2000.0), out=OUT, away=away
    )


def unsure(start_error_s: float) -> tuple[Finding, ...]:
    """Two of a model without a spread of its times, with a tolerance of their starts."""
    model = vehicles("a", model="falkowski-2023-quadrotor")
    tables = f"[separation]\nhorizontal_m = 5\nstart_error_s = {start_error_s!r}\n"
    first = sortie("s1", "a", 0.0, more='pack = "P"')
    return what_if(pad("a", 0, 0) + model + tables, SWAP, PACK, first)


def lifted(by_m: float) -> tuple[Finding, ...]:
    """A sortie that is flown so much higher than its job."""
    own = mission(up(20 + by_m), place(100, 0, 20 + by_m), rtl())
    flown = sortie("s1", "a", 0.0, more='mission = "part_1.plan"')
    return found(ALONE, flown, out=OUT, part_1=own)


def topmost(highest_m: float) -> tuple[Finding, ...]:
    """Layers up to there, for flights at 20 m."""
    tables = TWO + f"[layers]\nlowest_m = 10\nhighest_m = {highest_m!r}\nstep_m = 10\n"
    return found(tables, sortie("s1", "a", 0.0), sortie("s2", "b", 1000.0))


def delayed(*items: MissionItem) -> tuple[Finding, ...]:
    """Two far from each other, one with such items."""
    sorties = sortie("s1", "a", 0.0, job="waits"), sortie("s2", "b", 0.0, job="away")
    away = mission(up(20), place(-100, 200, 20), rtl())
    return found(TWO, *sorties, waits=mission(*items, place(100, 0, 20), rtl()), away=away)


WAIT = item(93, None, 0.0, params=(30.0, -1.0, -1.0, -1.0))
"""30 s, wherever the vehicle is."""


def swarm(
    apart_m: float, *, policy: str = "none", less_s: float | None = None
) -> tuple[Finding, ...]:
    """Two vehicles in formation so far apart, simulated until so long before they have landed."""
    until_s = 3600.0
    if less_s is not None:
        until_s = simulated(formation(apart_m), policy=policy).record.begin_s[-1] - less_s
    return simulated(formation(apart_m), policy=policy, until_s=until_s).findings


def seen(radius_m: float) -> tuple[Finding, ...]:
    """One vehicle that searches by lanes of 20 m and sees so far."""
    return simulated(search(agents=1, more=f"sensor_radius_m = {radius_m!r}\n")).findings


def ended(late_s: float) -> tuple[Finding, ...]:
    """An operation that ends so long before the last of two has landed."""
    ends_s = simulated(formation(20.0)).landed_s - late_s
    return simulated(f"[operation]\nlatest_s = {ends_s!r}\n", formation(20.0)).findings


def adrift(off_m: float, toward_deg: float) -> tuple[Finding, ...]:
    """Two 20 m apart, the western of which is so far off to somewhere when it has landed."""
    landed_s = simulated(formation(20.0), policy="none").landed_s
    keys = f"drift_m_s = {off_m / landed_s!r}\ntoward_deg = {toward_deg!r}\n"
    fault = f'[fault.f]\nkind = "loses-position"\nvehicle = "a"\n{keys}'
    return simulated(formation(20.0), fault, policy="none").findings


def drops_late(early_s: float) -> tuple[Finding, ...]:
    """A battery that drops so long before the landing."""
    at_s = simulated(formation(20.0), policy="none").agents[0].time_s - early_s
    fault = (
        f'[fault.f]\nkind = "battery-drops"\nvehicle = "a"\ncharge_left = 1.0\nat_s = {at_s!r}\n'
    )
    return simulated(formation(20.0), fault, policy="none").findings


def numbers(late_s: float) -> tuple[Finding, ...]:
    """Two agents, the last of which lands so long after they are to have."""
    ends_s = simulated(formation(20.0)).landed_s - late_s
    return simulate_numbers(
        fleet_of(formation(20.0)), (2,), limits=NumbersLimits(deadline_s=ends_s)
    ).findings


def fault_of(vehicle: str) -> tuple[Finding, ...]:
    """Two agents alone and together, with a late link of one."""
    fault = f'[fault.f]\nkind = "link-late"\nvehicle = "{vehicle}"\nlate_s = 0.1\n'
    return simulate_numbers(fleet_of(formation(20.0), fault), (1, 2)).findings


class Patient:
    """A policy of one's own by which all stand for so long before they fly as they want to."""

    needs_ticks, keeps_apart = True, True

    def __init__(self, stands_s: float) -> None:
        self.stands_s, self.goes = stands_s, False

    def commands_m_s(self, situation: SwarmSituation) -> FloatArray:
        self.goes |= bool(situation.waited_s.max() >= self.stands_s)
        return situation.wanted_m_s * self.goes


def patient(stands_s: float) -> tuple[Finding, ...]:
    return simulate_fleet(fleet_of(formation(20.0)), policy=Patient(stands_s)).findings


def packed(times: float) -> tuple[Finding, ...]:
    """The same on packs with so many times what the flight takes of agents that turn back at once."""
    flown = simulated(formation(20.0, two_packs(1.0)), policy="none").agents
    least_wh = max(one.energy_wh or 0.0 for one in flown) / 0.8
    return simulated(formation(20.0, two_packs(times * least_wh)), policy="none").findings


def gusts(wind_m_s: float, blows_m_s: float = 0.0, model: str = MODEL) -> tuple[Finding, ...]:
    """Two of a model in the gusts of a wind, of which so much blows."""
    conditions = f'[conditions]\nwind = "{blows_m_s!r}@270"\n' if blows_m_s else ""
    fault = f'[fault.f]\nkind = "gusts"\nwind_m_s = {wind_m_s!r}\n' if wind_m_s else ""
    tables = conditions + formation(20.0).replace(MODEL, model)
    return simulated(tables, fault, policy="none").findings


def turned(energy_wh: float) -> tuple[Finding, ...]:
    """On packs of so much: 2.9 Wh are taken, a fifth stays; two stops, 20 s and a step are kept."""
    return simulated(formation(20.0, two_packs(energy_wh)), policy="none").findings


def hurried(speed_m_s: float) -> tuple[Finding, ...]:
    """Two of the article's vehicles, whose model was identified up to 10 m/s, at a speed."""
    return simulated(f"[conditions]\nspeed_m_s = {speed_m_s!r}\n", formation(20.0)).findings


def with_packs(count: int) -> tuple[Finding, ...]:
    """The same with so many packs in the file."""
    packs = f'{SWAP}[pack.P]\nbattery = "77Wh"\ncount = {count}\n'
    return simulated(formation(20.0, packs), policy="none").findings


def two_packs(energy_wh: float) -> str:
    """Two packs of so much energy each, of which a fifth stays."""
    return f'{SWAP}[pack.P]\nbattery = "{energy_wh!r}Wh"\ncount = 2\n'


CASES: Mapping[str, RuleCases] = {
    "S105": RuleCases(
        fires=lambda: pack_again(59.0),
        boundary=lambda: pack_again(60.0),
        silent=lambda: pack_again(90.0),
    ),
    "S106": RuleCases(
        fires=lambda: charged(0.9), boundary=lambda: charged(0.995), silent=lambda: charged(1.0)
    ),
    "S107": RuleCases(
        fires=lambda: charger(-0.1), boundary=lambda: charger(0.0), silent=lambda: charger(5.0)
    ),
    "S108": RuleCases(
        fires=lambda: vehicle_again(59.0),
        boundary=lambda: vehicle_again(60.0),
        silent=lambda: vehicle_again(90.0),
    ),
    "S109": RuleCases(
        fires=lambda: one_pad(59.0), boundary=lambda: one_pad(60.0), silent=lambda: one_pad(1000.0)
    ),
    "S110": RuleCases(
        fires=lambda: needing('["camera"]'),
        boundary=lambda: needing("[]"),
        silent=lambda: needing('["lamp"]'),
    ),
    "S111": RuleCases(
        fires=lambda: until(0.1), boundary=lambda: until(0.0), silent=lambda: until(-1.0)
    ),
    "S112": RuleCases(
        fires=lambda: part(98.5), boundary=lambda: part(99.01), silent=lambda: part(100.0)
    ),
    "S113": RuleCases(
        fires=lambda: powered("unpowered.toml"),
        boundary=lambda: powered("px4-quad-2kg"),
        silent=lambda: powered("arducopter-sitl-quad"),
    ),
    "S114": RuleCases(
        fires=lambda: over(14.98), boundary=lambda: over(15.0), silent=lambda: over(15.5)
    ),
    "S115": RuleCases(
        fires=lambda: beside_the_way_home(9.9),
        boundary=lambda: beside_the_way_home(10.0),
        silent=lambda: beside_the_way_home(11.0),
    ),
    "S116": RuleCases(
        fires=lambda: pads_apart(4.9),
        boundary=lambda: pads_apart(5.0),
        silent=lambda: pads_apart(5.5),
    ),
    "S118": RuleCases(
        fires=lambda: powered("arducopter-sitl-quad"),
        boundary=lambda: powered("unpowered.toml"),
        silent=lambda: charged(1.0),
    ),
    "S122": RuleCases(
        fires=lambda: spare(0.1), boundary=lambda: spare(0.0), silent=lambda: spare(-10.0)
    ),
    "S123": RuleCases(
        fires=lambda: ageing(0.999),
        boundary=lambda: ageing(1.0 + 1e-9),  # exact but for rounding
        silent=lambda: ageing(1.01),
    ),
    "S124": RuleCases(
        fires=lambda: late(0.1), boundary=lambda: late(0.0), silent=lambda: late(-10.0)
    ),
    "S125": RuleCases(
        fires=lambda: put_beside(7.3),
        boundary=lambda: put_beside(7.6),  # 5 m and 2.5 m, to the 0.1 m of a return
        silent=lambda: put_beside(8.0),
    ),
    "S126": RuleCases(
        fires=lambda: unsure(0.0), boundary=lambda: unsure(0.001), silent=lambda: unsure(10.0)
    ),
    "S119": RuleCases(
        fires=lambda: lifted(0.05), boundary=lambda: lifted(0.04), silent=lambda: lifted(0.0)
    ),
    "S120": RuleCases(
        fires=lambda: topmost(10.0), boundary=lambda: topmost(30.0), silent=lambda: topmost(80.0)
    ),
    "S127": RuleCases(
        fires=lambda: delayed(WAIT, up(20)),
        boundary=lambda: delayed(up(20), WAIT),  # in the air it is counted
        silent=lambda: delayed(up(20)),
    ),
    "S132": RuleCases(
        fires=lambda: found(SWARM),
        boundary=lambda: found(ALONE, sortie("s1", "a", 0.0)),
        silent=lambda: found(TWO, sortie("s1", "a", 0.0)),
    ),
    "S133": RuleCases(
        fires=lambda: swarm(20.0),
        boundary=lambda: found(ALONE, sortie("s1", "a", 0.0)),
        silent=lambda: found(TWO, sortie("s1", "a", 0.0)),
    ),
    "S128": RuleCases(
        fires=lambda: swarm(14.9),
        boundary=lambda: swarm(15.0),  # 10 m and 2.5 m of each
        silent=lambda: swarm(20.0),
    ),
    "S129": RuleCases(
        # 10 m and 2.5 m of each are kept; so much more is about the way of a stop, of 0.2 m at most
        fires=lambda: swarm(14.9, policy="stop"),
        boundary=lambda: swarm(15.5, policy="stop"),
        silent=lambda: swarm(20.0, policy="stop"),
    ),
    "S130": RuleCases(
        fires=lambda: swarm(20.0, less_s=0.6),
        boundary=lambda: swarm(20.0, less_s=0.0),
        silent=lambda: swarm(20.0),
    ),
    "S131": RuleCases(
        # air that the model does not count: √(ρ₀/ρ) is 1.0195 to 1.0205 at 400 m to 420 m
        fires=lambda: packed(1.019),
        boundary=lambda: packed(1.021),
        silent=lambda: packed(5.0),
        shown=lambda: packed(0.999),
    ),
    "S134": RuleCases(
        # 20 m less 5 m are the 10 m and 2.5 m of each; the last step may end half a second later
        fires=lambda: adrift(5.1, 90.0),
        boundary=lambda: adrift(4.95, 90.0),
        silent=lambda: adrift(2.0, 90.0),
    ),
    "S135": RuleCases(
        fires=lambda: adrift(2.55, 270.0),
        boundary=lambda: adrift(2.48, 270.0),
        silent=lambda: adrift(1.0, 270.0),
    ),
    "S136": RuleCases(
        fires=lambda: drops_late(0.0),
        boundary=lambda: drops_late(0.001),
        silent=lambda: drops_late(60.0),
    ),
    "S137": RuleCases(
        fires=lambda: seen(9.0), boundary=lambda: seen(10.0), silent=lambda: seen(12.0)
    ),
    "S138": RuleCases(
        fires=lambda: ended(0.1), boundary=lambda: ended(0.0), silent=lambda: ended(-60.0)
    ),
    "S139": RuleCases(
        fires=lambda: numbers(0.1), boundary=lambda: numbers(0.0), silent=lambda: numbers(-60.0)
    ),
    "S140": RuleCases(
        fires=lambda: gusts(0.5),
        boundary=lambda: gusts(0.5, 0.5, "arducopter-sitl-quad"),
        silent=lambda: gusts(0.0),
    ),
    "S141": RuleCases(
        fires=lambda: turned(4.5), boundary=lambda: turned(6.5), silent=lambda: turned(20.0)
    ),
    "S142": RuleCases(
        fires=lambda: hurried(10.1), boundary=lambda: hurried(10.0), silent=lambda: hurried(5.0)
    ),
    "S143": RuleCases(
        fires=lambda: with_packs(1), boundary=lambda: with_packs(2), silent=lambda: with_packs(3)
    ),
    "S144": RuleCases(
        fires=lambda: fault_of("b"), boundary=lambda: fault_of("a"), silent=lambda: numbers(0.0)
    ),
    "S145": RuleCases(
        # ways are cleared after a minute, by ticks of half a second
        fires=lambda: patient(61.0),
        boundary=lambda: patient(59.0),
        silent=lambda: patient(0.0),
    ),
    "S117": RuleCases(
        fires=lambda: layers(9.9), boundary=lambda: layers(10.0), silent=lambda: layers(15.0)
    ),
}
